#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_simulation/faults/fault_options.h"
#include "vcharge_simulation/sensors/camera_response.h"

namespace vcharge {

/// An image as it reaches a recorder.
struct DeliveredImage {
  Timestamp stamp;     ///< that the image carries
  Timestamp received;  ///< when it arrives
  cv::Mat pixels;      ///< CV_8UC1
};

/// What faults do to images between the lens and the recorder. Call, for every camera and frame in order,
/// throughLens() with the noise-free image, then the sensor (noise and exposure), then deliver(). Without a
/// fault images pass unchanged. Not thread safe.
class ImageFaults {
 public:
  struct Camera {
    std::string name;
    int index;  ///< in the whole rig: what is random does not depend on which cameras are recorded
    cv::Size size_px;
  };
  /// Stamps (true ones) of the images that a random fault hit, per camera.
  struct Hits {
    std::vector<std::vector<Timestamp>> dropped, late;
  };

  /// `start` is the drive's; `seed` decides which images are dropped or late.
  ImageFaults(const FaultOptions& faults, const std::vector<Camera>& cameras, const CameraResponse& response,
              Timestamp start, uint64_t seed);

  /// The noise-free image (CV_8UC1) with the sun and the dirt on the lens. `stamp` is the true one.
  cv::Mat throughLens(size_t camera, Timestamp stamp, const cv::Mat& clean) const;

  /// Exposure over the normal one.
  double exposureGain(size_t camera, Timestamp stamp) const;

  /// What arrives of the sensor's image; nothing where it gets lost.
  std::optional<DeliveredImage> deliver(size_t camera, size_t frame, Timestamp stamp, const cv::Mat& image);

  const Hits& hits() const { return hits_; }

 private:
  Duration sinceStart(Timestamp stamp) const { return stamp - start_; }
  bool hit(const DroppedImagesFault& fault, size_t camera, size_t frame, Timestamp stamp,
           uint64_t kind) const;

  FaultOptions faults_;
  std::vector<Camera> cameras_;
  CameraResponse response_;
  Timestamp start_;
  uint64_t seed_;
  /// Per camera, CV_32FC1: light of the sun, share of the scene's light that passes the dirt, light of the
  /// dirt. Empty without the fault.
  std::vector<cv::Mat> sun_light_, dirt_transmission_, dirt_light_;
  std::vector<cv::Mat> last_image_;  ///< that a frozen camera repeats
  Hits hits_;
};

}  // namespace vcharge
