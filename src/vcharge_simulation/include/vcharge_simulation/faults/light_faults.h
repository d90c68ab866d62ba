#pragma once

#include <functional>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_simulation/sensors/camera_response.h"
#include "vcharge_simulation/sensors/recorded_cameras.h"

namespace vcharge {

/// Faults that change the light on the sensors: low light, vignetting, drops and dirt on the lens, sun and
/// lamps. They stay with the camera if plugs are swapped. Immutable, thread safe.
class LightFaults {
 public:
  /// True if no surface of the world lies between two points; null: nothing does.
  using IsVisible = std::function<bool(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m)>;

  /// `cameras` must outlive this object. `start` is the start of the drive.
  LightFaults(const FaultOptions& faults, const RecordedCameras& cameras, const CameraResponse& response,
              Timestamp start, IsVisible is_visible = nullptr);

  /// Light on the sensor (CV_32FC1). `clean` is such light, or a noise-free image at the normal exposure
  /// (CV_8UC1), whose highlights are those of the normal exposure; without a fault `clean` itself. `stamp` is
  /// the true stamp.
  cv::Mat apply(size_t camera, Timestamp stamp, const cv::Mat& clean, const Readout& readout) const;

 private:
  /// Maps of one lens, CV_32FC1; empty without the fault.
  struct Lens {
    cv::Mat vignette;  ///< transmission
    cv::Mat sun;       ///< light added by the sun
    /// Fraction of the scene's light that passes the dirt, fraction that it blurs, light that it scatters.
    cv::Mat dirt_transmission, dirt_blur, dirt_light;
  };

  void addLamps(const CameraView& view, const Readout& readout, cv::Mat* light) const;

  FaultOptions faults_;
  const RecordedCameras& cameras_;
  CameraResponse response_;
  Timestamp start_;
  IsVisible is_visible_;
  std::vector<Lens> lenses_;
};

}  // namespace vcharge
