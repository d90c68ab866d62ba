#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/rendering/renderer.h"
#include "vcharge_simulation/sensors/camera_response.h"
#include "vcharge_simulation/sensors/recorded_cameras.h"

namespace vcharge {

/// Hands out the noise-free images of a drive, frame by frame and in each frame camera by camera.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  virtual cv::Mat image(size_t camera, size_t frame) = 0;
};

/// Renders the images; the arguments must outlive the source. Things that move stand still during an
/// exposure. `scene_times_s`: one per frame.
std::unique_ptr<ImageSource> renderImages(const Renderer& renderer, const RecordedCameras& cameras,
                                          const CameraResponse& response, const SimulatedDrive& drive,
                                          const std::vector<double>& scene_times_s,
                                          const MotionBlurFault& blur);

/// Takes the images of a bag; the arguments must outlive the source. InputError, also while reading, for a
/// bag that cannot be read or is not one of the same drive and cameras.
std::unique_ptr<ImageSource> readImages(const std::string& bag, const CameraRig& rig,
                                        const SimulatedDrive& drive);

}  // namespace vcharge
