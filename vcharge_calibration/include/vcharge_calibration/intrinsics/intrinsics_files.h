#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Files of intrinsics that other calibrations write and read. Pixel centres lie at whole coordinates in all
/// of them, and their radial-tangential distortion is that of vcharge_core.
///
/// kRig: rig.yaml. kKalibr: camchain.yaml with cam0, cam1, ...; models omni-radtan (mei: intrinsics
/// [xi, gamma1, gamma2, u0, v0]), pinhole-equi (kannala_brandt) and pinhole-radtan (pinhole); T_cn_cnm1 is
/// the pose of the previous camera in this one. kCamodocal: one camera per file; MEI, KANNALA_BRANDT (mu, mv,
/// u0, v0, k2 to k5 are fx, fy, cx, cy, k1 to k4) and PINHOLE.
enum class IntrinsicsFormat { kRig, kKalibr, kCamodocal };

/// "rig", "kalibr", "camodocal"; std::invalid_argument for another name.
IntrinsicsFormat intrinsicsFormat(const std::string& name);

/// Cameras of a file whose format is seen from its content. Foreign files have no field of view:
/// `field_of_view_rad` is taken for all their cameras. Names are those of the file ("cam0" from Kalibr, the
/// camera_name from CamOdoCal). Extrinsics of foreign files are left out: they relate cameras to each other,
/// not to a vehicle. InputError names file, key and what was expected.
CameraRig readIntrinsics(const std::string& path, double field_of_view_rad);

/// Writes the cameras. Kalibr gets T_cn_cnm1 where all cameras have extrinsics, and the rig's names as
/// rostopic /camera/NAME/image_raw. InputError when CamOdoCal's format should hold more than one camera.
void writeIntrinsics(const CameraRig& rig, IntrinsicsFormat format, const std::string& path);

/// A camera of another model, and how far its pixels are from the given one's.
struct ConvertedCamera {
  CameraModel model;
  double rms_px = 0.0;  ///< distance
  double max_px = 0.0;
  /// Share of the pixels within the field of view that the new model can image.
  double covered_share = 0.0;
};

/// The camera of `model_name` that images the rays of `camera` closest to where it does, by least squares
/// over a grid of the pixels whose rays lie within field_of_view_rad / 2 of the axis. A pinhole camera is
/// fitted to the part within 70 degrees of the axis. std::invalid_argument for an unknown model or a field of
/// view in which the camera has too few pixels.
ConvertedCamera convertCamera(const CameraModel& camera, cv::Size image_size_px, double field_of_view_rad,
                              const std::string& model_name);

}  // namespace vcharge
