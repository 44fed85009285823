// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "../host_stage.h"
#include "../stage_numbers.h"
#include "capture_file.h"
#include "replay.h"

namespace btgpu {
namespace {

// The world's arrays as a capture has them.
class CapturedStageIo : public StageIo {
 public:
  enum class Moment { Before, After };
  CapturedStageIo(const Capture& capture, Moment moment, DeviceWorld& ofWorld, const StepSettings& ofStep)
      : StageIo(ofWorld, ofStep), m_capture(capture), m_moment(moment) {}

 protected:
  size_t bytesInUse(const ArrayInUse& array) override {
    const CapturedView& view = viewOf(array.name);
    return m_moment == Moment::Before ? view.bytesBefore : view.bytesAfter;
  }
  void readBytes(const ArrayInUse& array, size_t bytes, void* to) override {
    const CapturedView& view = viewOf(array.name);
    const bool before = m_moment == Moment::Before;
    const std::uint32_t index = before ? view.before : view.after;
    if (index == CapturedView::kNone) throw lacks(array.name);
    const CapturedArray& from = m_capture.arrays[index];
    std::memcpy(to, (before ? from.before : from.expected()).data(), bytes);
  }
  Queue& queue() override { throw std::logic_error("a capture is only read"); }

 private:
  const CapturedView& viewOf(const std::string& name) const {
    const auto view = std::find_if(m_capture.views.begin(), m_capture.views.end(),
                                   [&](const CapturedView& v) { return v.array == name; });
    if (view == m_capture.views.end()) throw lacks(name);
    return *view;
  }
  CaptureError lacks(const std::string& name) const {
    return CaptureError(fmt::format("lacks the {} that the reference of {} reads", name, m_capture.stage));
  }

  const Capture& m_capture;
  Moment m_moment;
};

}  // namespace

std::optional<StageDifference> checkOnHost(const Capture& capture) {
  const auto stage = hostStage(capture.stage);
  if (!stage) throw CaptureError(fmt::format("is of {}, which has no reference on the host", capture.stage));
  if (capture.numbers.size() != kStageNumbers) throw CaptureError("has nothing for the reference on the host");
  using Moment = CapturedStageIo::Moment;
  DeviceWorld world;
  StepSettings settings;
  setStageNumbers(capture.numbers, world, settings);
  CapturedStageIo before(capture, Moment::Before, world, settings), after(capture, Moment::After, world, settings);
  stage->compute(before);
  Contract contract(stage->name());
  stage->check(after, contract);
  return contract.first();
}

ReplayReport replayOnHost(const std::string& file) {
  const Capture capture = readCapture(file);
  ReplayReport report;
  report.sameDevice = true;
  report.text = introduction(capture);
  try {
    const auto difference = checkOnHost(capture);
    report.differentArrays = difference ? 1 : 0;
    report.text += difference ? textOf(*difference) + "\n" : "within the contract of the reference on the host\n";
  } catch (const CaptureError& e) { throw CaptureError(fmt::format("{} {}", file, e.what())); }
  return report;
}

}  // namespace btgpu
