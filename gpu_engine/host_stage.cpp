// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "host_stage.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace btgpu {
namespace {

std::vector<std::unique_ptr<HostStage>> allStages() {
  std::vector<std::unique_ptr<HostStage>> stages;
  for (auto* make : {hostApplyForces,
                     hostPlaceChildren,
                     hostUpdateAabbs,
                     hostFindPairs,
                     hostGroupPairs,
                     hostCollidePrimitives,
                     hostFindSeparatingAxis,
                     hostClipFaces,
                     hostFindClosestFeatures,
                     hostClipConvexFaces,
                     hostReduceAndMatchContacts,
                     hostAppendHostContacts,
                     hostPrepareJoints,
                     hostBuildIslands,
                     hostColourConstraints,
                     hostSplitBodies,
                     hostBatchConstraints,
                     hostPrepareContacts,
                     hostSplitMasses,
                     hostSolveVelocities,
                     hostSolveSplits,
                     hostSolveBatches,
                     hostPrepareSoftContacts,
                     hostSolveSubsteps,
                     hostIntegratePoses,
                     hostUpdateActivation,
                     hostGatherContacts,
                     hostCullTriangles,
                     hostCollideTriangles}) {
    stages.push_back(make());
  }
  for (auto* make : {hostFindPairsGrid, hostFindPairsSweep, hostFindPairsIncremental, hostFindPairsBruteForce}) {
    stages.push_back(make());
  }
  return stages;
}

// "44" is the number of two stages.
bool isMeant(const std::string& wanted, const std::string& name) {
  return name == wanted || name.substr(0, name.find('_')) == wanted;
}

}  // namespace

HostStage::HostStage(const char* name, std::vector<std::string> alsoReads)
    : m_name(name), m_alsoReads(std::move(alsoReads)) {
  m_alsoReads.insert(m_alsoReads.end(), {"step params", "step counters"});
}

std::unique_ptr<HostStage> hostStage(const std::string& name) {
  for (auto& stage : allStages()) {
    if (stage->name() == name) return std::move(stage);
  }
  return nullptr;
}

HostStages::HostStages(const std::string& onHost, bool check) : m_check(check) {
  if (onHost.empty() && !check) return;
  m_stages = allStages();
  std::istringstream list(onHost);
  for (std::string wanted; std::getline(list, wanted, ',');) {
    const size_t before = m_onHost.size();
    for (const auto& stage : m_stages) {
      if (isMeant(wanted, stage->name())) m_onHost.push_back(stage.get());
    }
    if (m_onHost.size() == before) throw std::invalid_argument(fmt::format("there is no stage \"{}\"", wanted));
  }
}

bool HostStages::isOnHost(const HostStage& stage) const {
  return std::find(m_onHost.begin(), m_onHost.end(), &stage) != m_onHost.end();
}

HostStage* HostStages::begin(const char* name, StageIo& io) {
  const auto stage =
      std::find_if(m_stages.begin(), m_stages.end(), [&](const auto& s) { return s->name() == std::string(name); });
  // After the first difference there is nothing more to learn from this step, and after an overflow nothing happens.
  const bool wanted = stage != m_stages.end() && (isOnHost(**stage) || (m_check && m_differences.empty()));
  if (!wanted || io.counters().overflow) return nullptr;
  (*stage)->compute(io);
  return stage->get();
}

void HostStages::end(HostStage& stage, StageIo& io) {
  if (isOnHost(stage)) return stage.store(io);
  Contract contract(stage.name());
  stage.check(io, contract);
  if (!contract.ok()) m_differences.push_back(*contract.first());
}

}  // namespace btgpu
