#pragma once

#include <string>
#include <vector>

#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Reads the images of a folder (png, jpg, bmp, tif, pgm; ignores other files) in the order of their names.
/// InputError names a folder without images or an image that cannot be read.
std::vector<CalibrationImage> readCalibrationImages(const std::string& folder);

/// Outputs of an intrinsic calibration.
struct CalibrationOutput {
  std::string camera_name;
  double field_of_view_rad = 0.0;  ///< full angle; 0: up to the outermost corner
  std::string rig_file;            ///< rig.yaml
  bool keep_others = false;        ///< keep other cameras of an existing file
  std::string report_file;         ///< HTML; empty: none
};

/// Writes the report, and the rig.yaml unless the verdict is kFail. InputError for an invalid camera name or
/// a file that cannot be written.
void writeCalibration(const CalibrationOutput& output, const CalibrationBoard& board,
                      const std::vector<CalibrationImage>& images, const IntrinsicCalibration& result);

}  // namespace vcharge
