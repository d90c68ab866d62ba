#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_model.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// File formats for intrinsics. In all of them, pixel centres have integer coordinates, and radial-tangential
/// distortion is that of vcharge_core.
/// kRig: rig.yaml.
/// kKalibr: camchain.yaml with cam0, cam1, ...; models omni-radtan (mei: intrinsics [xi, gamma1, gamma2, u0,
/// v0]), pinhole-equi (kannala_brandt) and pinhole-radtan (pinhole); T_cn_cnm1 is the pose of the previous
/// camera in this one.
/// kCamodocal: one camera per file; MEI, KANNALA_BRANDT (mu, mv, u0, v0, k2 to k5 are fx, fy, cx, cy, k1 to
/// k4) and PINHOLE.
enum class IntrinsicsFormat { kRig, kKalibr, kCamodocal };

/// Parses "rig", "kalibr" or "camodocal"; throws std::invalid_argument for another name.
IntrinsicsFormat intrinsicsFormat(const std::string& name);

/// Reads the cameras of a file and detects its format. Kalibr's and CamOdoCal's files have no field of view:
/// `field_of_view_rad` is used for all of their cameras, and their extrinsics, which do not refer to a
/// vehicle, are ignored. Names are those of the file ("cam0" for Kalibr, camera_name for CamOdoCal). Throws
/// InputError naming the file, the key and what was expected.
CameraRig readIntrinsics(const std::string& path, double field_of_view_rad);

/// Writes the cameras. Kalibr's format gets T_cn_cnm1 if all cameras have extrinsics, and topics
/// /camera/NAME/image_raw. Throws InputError for more than one camera in CamOdoCal's format.
void writeIntrinsics(const CameraRig& rig, IntrinsicsFormat format, const std::string& path);

/// A camera converted to another model, and the difference of its pixels.
struct ConvertedCamera {
  CameraModel model;
  double rms_px = 0.0;  ///< RMS distance between the pixels
  double max_px = 0.0;
  /// Fraction of the pixels within the field of view that the new model can image.
  double covered_fraction = 0.0;
};

/// The camera of model `model_name` closest to `camera`, by least squares of the pixel distance over a grid
/// of pixels whose rays lie within field_of_view_rad / 2 of the axis. A pinhole camera is fitted within 70
/// degrees of the axis. Throws std::invalid_argument for an unknown model or a field of view with too few
/// pixels.
ConvertedCamera convertCamera(const CameraModel& camera, cv::Size image_size_px, double field_of_view_rad,
                              const std::string& model_name);

}  // namespace vcharge
