#pragma once

#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

/// Conversion of the published V-Charge images to a drive. The recording's vehicle frame is above the ground.
struct VchargeRecordingOptions {
  std::string camera_name = "left";
  double field_of_view_rad = 3.2288591161895095;  ///< 185 degrees
  /// The ground in the recording's vehicle frame: z = height + slope_x x + slope_y y. base_link is on it,
  /// with z along its normal. The default was fitted to the ground around the reference frame of the
  /// recording.
  double ground_height_m = -0.832;
  double ground_slope_x = 0.0036;
  double ground_slope_y = -0.0045;
  double odometry_margin_s = 0.5;  ///< poses kept before the first and after the last image
  bool mask_vehicle = true;        ///< masks the car's body in the image of the left mirror's camera

  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// A recording in the layout of the V-Charge images that were published with PlaneSweepLib.
struct VchargeRecording {
  struct ImageFile {
    Timestamp stamp;
    std::string path;
  };
  CameraRig rig;  ///< the one camera, with vehicle_from_camera
  std::vector<ImageFile> images;
  std::vector<VehicleOdometry> odometry;
};

/// Reads calib.txt (fx skew cx fy cy xi k1 k2 p1 p2, then 3x4 vehicle_from_camera), system_poses.txt (time_us
/// yaw pitch roll tx ty tz = world_from_vehicle) and images.txt (names that end in _<time_us>.png) of a
/// folder. Velocities are central differences of the poses. InputError naming file and line for anything
/// else, for stamps that do not increase and for images outside the time of the poses.
VchargeRecording readVchargeRecording(const std::string& folder,
                                      const VchargeRecordingOptions& options = VchargeRecordingOptions());

}  // namespace vcharge
