#pragma once

#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/camera/image_timing.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// One camera of a rig.
struct RigCamera {
  std::string name;      ///< for example "front"
  std::string frame_id;  ///< for example "camera_front_optical"
  cv::Size image_size_px;
  CameraModel model;
  double field_of_view_rad =
      3.14159265358979;   ///< pixels whose ray leaves this cone (full angle) are not used
  std::string mask_file;  ///< path as written in rig.yaml; empty without a mask
  cv::Mat mask;           ///< CV_8UC1 of image_size_px, 0 where the vehicle is seen; empty without a mask
  std::optional<RigidTransform> vehicle_from_camera;  ///< absent before extrinsic calibration
  /// Covariance of vehicle_from_camera, over [dt, dphi] in the vehicle frame: t = t_hat + dt, R = Exp(dphi)
  /// R_hat; for a given scale of the rig, see CameraRig::scale_sigma.
  std::optional<Eigen::Matrix<double, 6, 6>> covariance;
  // Standard deviations of the intrinsics: of the focal length, relative, and of the principal point. 0:
  // unknown.
  double focal_sigma = 0.0;
  double principal_point_sigma_px = 0.0;
  ImageTiming timing;

  /// Exposure of a pixel after the image's stamp, on the vehicle's clock.
  double exposedAt(const Eigen::Vector2d& position_px) const {
    return timing.exposedAt(position_px, image_size_px);
  }
};

/// True for a letter followed by letters, digits and underscores, since names become topics and files.
bool isCameraName(const std::string& name);

/// The cameras of a vehicle, in the order of rig.yaml. Shared as shared_ptr<const CameraRig>.
class CameraRig {
 public:
  std::string vehicle_frame = "base_link";
  std::vector<RigCamera> cameras;
  /// Relative standard deviation of the scale that all translations have in common, which comes from the
  /// wheels' size; 0 if it is unknown.
  double scale_sigma = 0.0;
  /// Images whose stamps differ by at most this are one frame, each at its own time: for cameras that no
  /// common trigger starts. 0: images of a frame have one stamp.
  double stamp_tolerance_s = 0.0;
  /// How the rig was made, by keys such as `program`. For people only: nothing depends on it.
  std::map<std::string, std::string> provenance;

  /// Index of the camera with this name, or -1.
  int findCamera(const std::string& name) const;
  /// Index of the camera with this name. Throws an InputError that lists the available names.
  size_t cameraIndex(const std::string& name) const;
  /// Covariance of a camera's vehicle_from_camera that includes the common scale; absent without covariance.
  std::optional<Eigen::Matrix<double, 6, 6>> covarianceWithScale(size_t camera) const;
  /// True when every camera has vehicle_from_camera.
  bool hasExtrinsics() const;
};

/// Reads rig.yaml and its masks (paths relative to the file). Throws InputError naming the file, the key and
/// what was expected: for unknown keys, non-finite numbers, a rotation whose norm differs from 1 by more than
/// 1e-3, a mask of another size.
CameraRig readCameraRig(const std::string& path);
/// Reads a rig from text; `source` names it in errors, and mask paths are relative to `mask_folder`.
CameraRig parseCameraRig(const std::string& text, const std::string& source, const std::string& mask_folder);
/// The text of rig.yaml, with numbers exact to the last bit. Masks are named but not written.
std::string formatCameraRig(const CameraRig& rig);
/// Writes rig.yaml, with numbers exact to the last bit, and the masks. Replaces an older file only when the
/// new one is complete.
void writeCameraRig(const CameraRig& rig, const std::string& path);
/// Whether two rigs have cameras of the same names and image sizes, in the same order.
bool haveSameImages(const CameraRig& a, const CameraRig& b);
/// Throws InputError naming `source` (a file or topic) unless `size` is the camera's image size.
void checkImageSize(const RigCamera& camera, cv::Size size, const std::string& source);

}  // namespace vcharge
