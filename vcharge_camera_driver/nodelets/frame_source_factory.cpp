#include "frame_source_factory.h"

#include <utility>

#include "bag_frame_source.h"
#include "vcharge_core/base/error.h"

namespace vcharge {

DriverOptions completeOptions(const DriverOptions& options, const CameraRig& rig, const std::string& source) {
  DriverOptions complete = options;
  if (complete.cameras.empty()) {
    for (const RigCamera& camera : rig.cameras) {
      complete.cameras.push_back(camera.name);
    }
  }
  if (options.source == FrameSourceKind::kV4l2 && options.devices.size() != complete.cameras.size()) {
    throw InputError("parameter " + source + ": devices: expected " +
                     std::to_string(complete.cameras.size()) + ", one per camera, got " +
                     std::to_string(options.devices.size()));
  }
  const cv::Size size = rig.cameras.at(rig.cameraIndex(complete.cameras.front())).image_size_px;
  for (const std::string& name : complete.cameras) {
    const RigCamera& camera = rig.cameras[rig.cameraIndex(name)];
    checkImageSize(camera, size, "parameter " + source + ": cameras: " + complete.cameras.front());
    complete.v4l2.readouts_s.push_back(camera.timing.readout_s);
  }
  complete.v4l2.capture.image_size_px = size;
  return complete;
}

std::unique_ptr<FrameSource> makeFrameSource(const DriverOptions& options,
                                             const std::shared_ptr<const CameraRig>& rig,
                                             std::function<Timestamp()> now,
                                             std::function<void(const WheelTicks&)> ticks) {
  const auto& capture = options.v4l2.capture;
  switch (options.source) {
    case FrameSourceKind::kV4l2:
      return std::make_unique<V4l2FrameSource>(options.devices, options.v4l2, std::move(now));
    case FrameSourceKind::kFolder:
      return std::make_unique<FolderFrameSource>(options.folder, options.cameras, capture.image_size_px,
                                                 capture.frame_rate_hz, options.loop, std::move(now));
    case FrameSourceKind::kBag:
      break;
  }
  return std::make_unique<BagFrameSource>(options.bag, rig, options.cameras, capture.frame_rate_hz,
                                          std::move(now), std::move(ticks));
}

}  // namespace vcharge
