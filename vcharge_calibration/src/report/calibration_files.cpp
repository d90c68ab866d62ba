#include "vcharge_calibration/report/calibration_files.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_calibration/intrinsics/intrinsic_report.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {

namespace fs = std::filesystem;

std::vector<CalibrationImage> readCalibrationImages(const std::string& folder) {
  if (!fs::is_directory(folder)) {
    throw InputError(folder + ": expected a folder of images");
  }
  std::vector<std::string> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::string extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    for (const char* known : {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm"}) {
      if (extension == known) {
        paths.push_back(entry.path().string());
      }
    }
  }
  if (paths.empty()) {
    throw InputError(folder + ": expected images (png, jpg, bmp, tif, pgm), found none");
  }
  std::sort(paths.begin(), paths.end());
  std::vector<CalibrationImage> images;
  for (const std::string& path : paths) {
    images.push_back({fs::path(path).filename().string(), cv::imread(path, cv::IMREAD_GRAYSCALE)});
    if (images.back().pixels.empty()) {
      throw InputError(path + ": expected an image, cannot be read");
    }
  }
  return images;
}

void writeCalibration(const CalibrationOutput& output, const CalibrationBoard& board,
                      const std::vector<CalibrationImage>& images, const IntrinsicCalibration& result) {
  if (!isCameraName(output.camera_name)) {
    throw InputError("camera: expected a letter, then letters, digits and underscores, got '" +
                     output.camera_name + "'");
  }
  if (!output.report_file.empty()) {
    writeTextFileAtomically(output.report_file, makeIntrinsicReport("Intrinsics of " + output.camera_name,
                                                                    board, images, result));
  }
  if (!result.model.has_value()) {
    return;
  }
  CameraRig rig;
  if (output.keep_others && fs::exists(output.rig_file)) {
    rig = readCameraRig(output.rig_file);
  }
  RigCamera camera{output.camera_name,
                   "camera_" + output.camera_name + "_optical",
                   result.image_size_px,
                   *result.model,
                   output.field_of_view_rad > 0.0 ? output.field_of_view_rad : 2.0 * result.max_angle_rad,
                   "",
                   {},
                   {},
                   {}};
  camera.focal_sigma = result.focal_sigma;
  camera.principal_point_sigma_px = result.principal_point_sigma_px;
  const int index = rig.findCamera(output.camera_name);
  if (index < 0) {
    rig.cameras.push_back(camera);
  } else {
    rig.cameras[static_cast<size_t>(index)] = camera;
  }
  writeCameraRig(rig, output.rig_file);
}

}  // namespace vcharge
