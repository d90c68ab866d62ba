#include "vcharge_reconstruction/reconstruction_report.h"

#include <algorithm>

namespace vcharge {

void ReconstructionReport::noteFrame(const ImageFrame& frame, const CameraRig& rig,
                                     const FrameCounters& frame_counters) {
  counters = frame_counters;
  std::string missing;
  for (size_t i = 0; i < frame.has_image.size(); ++i) {
    if (!frame.has_image[i]) {
      missing += (missing.empty() ? "without camera " : ", ") + rig.cameras[i].name;
    }
  }
  if (!missing.empty()) {
    noteSkipped(frame.stamp, missing);
  }
  if (!frame.bridged_from_vehicle) {
    noteSkipped(frame.stamp, describe(frame.odometry_status));
  }
}

void ReconstructionReport::noteSkipped(Timestamp stamp, const std::string& reason) {
  auto last = std::find_if(skipped.rbegin(), skipped.rend(),
                           [&](const SkippedFrames& entry) { return entry.reason == reason; });
  if (last == skipped.rend() || last->last_frame + 1 < counters.frames) {
    skipped.push_back({reason, stamp, stamp, 0, 0});
    last = skipped.rbegin();
  }
  last->last = stamp;
  last->last_frame = counters.frames;
  ++last->num_frames;
}

}  // namespace vcharge
