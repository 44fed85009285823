// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A stage on the host: its reference between the world's arrays on the device. It can take the place of the stage, or
// tell whether what the stage did is within its contract.
#pragma once

#include <memory>
#include <vector>

#include "stage_io.h"
#include "stages/contract.h"

namespace btgpu {

class HostStage {
 public:
  // alsoReads: names of the arrays that the reference reads and the stage's kernels do not get, apart from the step's
  // params and counters. Captures have them too.
  explicit HostStage(const char* name, std::vector<std::string> alsoReads = {});
  virtual ~HostStage() = default;
  const char* name() const { return m_name; }  // as the profile has it, "10_apply_forces"
  const std::vector<std::string>& alsoReads() const { return m_alsoReads; }

  // Before the stage: reads what it reads, and finds what the reference makes of that.
  virtual void compute(StageIo& io) = 0;
  // In the stage's place: writes what it would have written.
  virtual void store(StageIo& io) = 0;
  // After the stage: holds what it wrote against the reference.
  virtual void check(StageIo& io, Contract& contract) = 0;

 private:
  const char* m_name;
  std::vector<std::string> m_alsoReads;
};

// The one of that name; null if there is none.
std::unique_ptr<HostStage> hostStage(const std::string& name);

// Each lives in stages/NN_stem_host.cpp.
std::unique_ptr<HostStage> hostApplyForces();
std::unique_ptr<HostStage> hostPlaceChildren();
std::unique_ptr<HostStage> hostUpdateAabbs();
std::unique_ptr<HostStage> hostFindPairs();
std::unique_ptr<HostStage> hostFindPairsGrid();
std::unique_ptr<HostStage> hostFindPairsSweep();
std::unique_ptr<HostStage> hostFindPairsIncremental();
std::unique_ptr<HostStage> hostFindPairsBruteForce();
std::unique_ptr<HostStage> hostGroupPairs();
std::unique_ptr<HostStage> hostCullTriangles();
std::unique_ptr<HostStage> hostCollidePrimitives();
std::unique_ptr<HostStage> hostFindSeparatingAxis();
std::unique_ptr<HostStage> hostClipFaces();
std::unique_ptr<HostStage> hostFindClosestFeatures();
std::unique_ptr<HostStage> hostClipConvexFaces();
std::unique_ptr<HostStage> hostCollideTriangles();
std::unique_ptr<HostStage> hostReduceAndMatchContacts();
std::unique_ptr<HostStage> hostAppendHostContacts();
std::unique_ptr<HostStage> hostPrepareJoints();
std::unique_ptr<HostStage> hostBuildIslands();
std::unique_ptr<HostStage> hostColourConstraints();
std::unique_ptr<HostStage> hostSplitBodies();
std::unique_ptr<HostStage> hostBatchConstraints();
std::unique_ptr<HostStage> hostPrepareContacts();
std::unique_ptr<HostStage> hostSplitMasses();
std::unique_ptr<HostStage> hostSolveVelocities();
std::unique_ptr<HostStage> hostSolveSplits();
std::unique_ptr<HostStage> hostSolveBatches();
std::unique_ptr<HostStage> hostPrepareSoftContacts();
std::unique_ptr<HostStage> hostSolveSubsteps();
std::unique_ptr<HostStage> hostIntegratePoses();
std::unique_ptr<HostStage> hostUpdateActivation();
std::unique_ptr<HostStage> hostGatherContacts();

// Which stages run on the host, and whether the others are held against it.
class HostStages {
 public:
  // `onHost`: numbers or names, separated by commas. Throws std::invalid_argument if there is no such stage.
  HostStages(const std::string& onHost, bool check);
  bool any() const { return m_check || !m_onHost.empty(); }

  // Runs the stage of that name on the device by `enqueue`, or on the host, or both.
  template <typename Enqueue>
  void run(const char* name, StageIo& io, const Enqueue& enqueue) {
    HostStage* stage = begin(name, io);
    if (!stage || !isOnHost(*stage)) enqueue();
    if (stage) end(*stage, io);
  }

  // Of the step so far. Cleared.
  std::vector<StageDifference> takeDifferences() { return std::exchange(m_differences, {}); }

 private:
  HostStage* begin(const char* name, StageIo& io);
  void end(HostStage& stage, StageIo& io);
  bool isOnHost(const HostStage& stage) const;

  std::vector<std::unique_ptr<HostStage>> m_stages;
  std::vector<const HostStage*> m_onHost;
  bool m_check;
  std::vector<StageDifference> m_differences;
};

}  // namespace btgpu
