#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/rendering/renderer.h"
#include "vcharge_simulation/sensors/camera_response.h"
#include "vcharge_simulation/sensors/lens_glare.h"
#include "vcharge_simulation/sensors/recorded_cameras.h"

namespace vcharge {

/// Noise-free images of a drive (CV_8UC1 at the normal exposure, or CV_32FC1 light), to be read frame by
/// frame and, within a frame, camera by camera.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  virtual cv::Mat image(size_t camera, size_t frame) = 0;
};

/// Renders the images; the arguments must outlive the source. `scene_times_s` has one entry per frame. With
/// `glare` (may be null) they are light, since the normal exposure does not suit every condition.
std::unique_ptr<ImageSource> renderImages(const Renderer& renderer, const RecordedCameras& cameras,
                                          const CameraResponse& response, const SimulatedDrive& drive,
                                          const std::vector<double>& scene_times_s,
                                          const MotionBlurFault& blur, const LensGlare* glare);

/// Tells whether an image differs from that of the same drive without faults.
using IsChanged = std::function<bool(size_t camera, size_t frame)>;

/// Reads the images of a bag, but takes those that are changed from another source, which may be null if none
/// is; the arguments must outlive the source. Throws InputError, also while reading, if the bag cannot be
/// read or is of another drive or of other cameras.
std::unique_ptr<ImageSource> readImages(const std::string& bag, const CameraRig& rig,
                                        const SimulatedDrive& drive, IsChanged is_changed,
                                        std::unique_ptr<ImageSource> changed);

}  // namespace vcharge
