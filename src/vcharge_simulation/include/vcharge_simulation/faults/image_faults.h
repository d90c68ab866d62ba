#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_simulation/faults/fault_options.h"

namespace vcharge {

/// An image as the recorder receives it.
struct DeliveredImage {
  Timestamp stamp;     ///< stamp in the message header
  Timestamp received;  ///< arrival time
  cv::Mat pixels;      ///< CV_8UC1
};

/// Applies camera faults between sensor and recorder. For every camera and frame, in order, call deliver().
/// Images pass unchanged without a fault. Not thread safe.
class ImageFaults {
 public:
  struct Camera {
    std::string name;
    int index;  ///< in the whole rig, so that random faults do not depend on which cameras are recorded
  };
  /// True stamps of the images hit by a random fault, per camera.
  struct Hits {
    std::vector<std::vector<Timestamp>> dropped, late;
  };

  /// `start` is the start of the drive; `seed` selects the dropped and late images.
  ImageFaults(const FaultOptions& faults, const std::vector<Camera>& cameras, Timestamp start, uint64_t seed);

  /// The image that arrives at the recorder; std::nullopt if it is lost.
  std::optional<DeliveredImage> deliver(size_t camera, size_t frame, Timestamp stamp, const cv::Mat& image);

  const Hits& hits() const { return hits_; }

 private:
  Duration sinceStart(Timestamp stamp) const { return stamp - start_; }
  bool hit(const DroppedImagesFault& fault, size_t camera, size_t frame, Timestamp stamp,
           uint64_t kind) const;

  FaultOptions faults_;
  std::vector<Camera> cameras_;
  Timestamp start_;
  uint64_t seed_;
  std::vector<cv::Mat> last_image_;  ///< last image before the camera froze
  Hits hits_;
};

}  // namespace vcharge
