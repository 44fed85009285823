// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "15_place_children_reference.h"

namespace btgpu {
namespace {

class HostPlaceChildren : public HostStage {
 public:
  HostPlaceChildren() : HostStage("15_place_children", {"infos", "poses", "activations"}) {}

  void compute(StageIo& io) override {
    m_childPoses = io.readBodies(io.world.childPoses);
    m_expected = read(io);
    placeChildrenReference(m_childPoses, m_expected);
  }
  void store(StageIo& io) override {
    io.write(io.world.infos, m_expected.infos);
    io.write(io.world.poses, m_expected.poses);
    io.write(io.world.steps, m_expected.steps);
    io.write(io.world.activations, m_expected.activations);
  }
  void check(StageIo& io, Contract& contract) override {
    checkPlacedChildren(contract, m_childPoses, read(io), m_expected);
  }

 private:
  static PlacedChildren read(StageIo& io) {
    DeviceWorld& w = io.world;
    return {io.readBodies(w.infos), io.readBodies(w.poses), io.readBodies(w.steps), io.readBodies(w.activations)};
  }

  std::vector<BodyPose> m_childPoses;
  PlacedChildren m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostPlaceChildren() { return std::make_unique<HostPlaceChildren>(); }

}  // namespace btgpu
