#include "vcharge_reconstruction/frame_gatherer.h"

#include <utility>

namespace vcharge {
namespace {

FrameAssemblerOptions assemblerOptions(double max_speed_m_per_s) {
  FrameAssemblerOptions options;
  options.waitForEverything();
  options.max_speed_m_per_s = max_speed_m_per_s;
  return options;
}

}  // namespace

FrameGatherer::FrameGatherer(std::shared_ptr<const CameraRig> rig, double max_speed_m_per_s,
                             ReconstructionReport* report, FrameCallback on_frame)
    : rig_(std::move(rig)),
      report_(report),
      on_frame_(std::move(on_frame)),
      assembler_(rig_->cameras.size(), assemblerOptions(max_speed_m_per_s),
                 [this](const ImageFrame& frame) { process(frame); }) {
  report_->num_missing_images.assign(rig_->cameras.size(), 0);
}

void FrameGatherer::addOdometry(const VehicleOdometry& odometry) {
  const int64_t num_resets = assembler_.counters().odometry_resets;
  assembler_.addOdometry(odometry);
  report_->num_odometry_resets += assembler_.counters().odometry_resets - num_resets;
}

void FrameGatherer::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  if (!assembler_.addImage(camera_index, stamp, image)) {
    ++report_->num_late_images;
  }
}

void FrameGatherer::process(const ImageFrame& frame) {
  ++report_->num_frames;
  if (const std::string missing = missingCameras(frame); !missing.empty()) {
    ++report_->num_incomplete_frames;
    noteSkipped(frame.stamp, missing);
  }
  if (frame.bridged_from_vehicle) {
    on_frame_(frame.stamp, frame.images, *frame.bridged_from_vehicle);
  } else {
    ++report_->num_frames_without_odometry;
    noteSkipped(frame.stamp, describe(frame.odometry_status));
  }
}

std::string FrameGatherer::missingCameras(const ImageFrame& frame) {
  std::string names;
  for (size_t i = 0; i < frame.images.size(); ++i) {
    if (!frame.has_image[i]) {
      ++report_->num_missing_images[i];
      names += (names.empty() ? "without camera " : ", ") + rig_->cameras[i].name;
    }
  }
  return names;
}

void FrameGatherer::noteSkipped(Timestamp stamp, const std::string& reason) {
  std::vector<SkippedFrames>& skipped = report_->skipped;
  const auto [last, is_new] = last_skipped_.try_emplace(reason);
  if (is_new || last->second.frame + 1 < report_->num_frames) {
    last->second.entry = skipped.size();
    skipped.push_back({reason, stamp, stamp, 0});
  }
  last->second.frame = report_->num_frames;
  skipped[last->second.entry].last = stamp;
  ++skipped[last->second.entry].num_frames;
}

}  // namespace vcharge
