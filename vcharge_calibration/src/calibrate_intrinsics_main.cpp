#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_calibration/intrinsic_calibration.h"
#include "vcharge_core/camera_rig.h"
#include "vcharge_core/command_line.h"
#include "vcharge_core/error.h"
#include "vcharge_core/progress_bar.h"

namespace {

namespace fs = std::filesystem;

std::vector<vcharge::CalibrationImage> readImages(const std::string& folder) {
  if (!fs::is_directory(folder)) {
    throw vcharge::InputError(folder + ": expected a folder of images");
  }
  std::vector<std::string> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::string extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    for (const char* known : {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm"}) {
      if (extension == known) {
        paths.push_back(entry.path().string());
      }
    }
  }
  if (paths.empty()) {
    throw vcharge::InputError(folder + ": expected images (png, jpg, bmp, tif, pgm), found none");
  }
  std::sort(paths.begin(), paths.end());
  std::vector<vcharge::CalibrationImage> images;
  for (const std::string& path : paths) {
    images.push_back({fs::path(path).filename().string(), cv::imread(path, cv::IMREAD_GRAYSCALE)});
    if (images.back().pixels.empty()) {
      throw vcharge::InputError(path + ": expected an image, cannot be read");
    }
  }
  return images;
}

void print(const vcharge::IntrinsicCalibration& result) {
  const std::vector<std::string> names = result.model->parameterNames();
  const Eigen::VectorXd values = result.model->parameters();
  for (size_t i = 0; i < names.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    std::printf("  %-7s %12.6f +- %.6f\n", names[i].c_str(), values[k], result.standard_deviations[k]);
  }
  std::printf(
      "%zu images used, %zu left out; error %.3f px RMS per coordinate, %.3f px mean distance, %.3f px in "
      "views "
      "that the fit did not see; corners up to %.0f degrees from the axis on %.0f %% of the image\n",
      result.views.size(), result.rejected.size(), result.rms_px, result.mean_error_px,
      result.cross_validated_px, result.max_angle_rad * 180.0 / 3.14159265358979,
      100.0 * result.covered_share);
}

void calibrate(const std::string& folder, const vcharge::CalibrationBoard& board, const std::string& camera_name,
               double field_of_view_rad, const vcharge::IntrinsicCalibrationOptions& options,
               const std::string& output) {
  const std::vector<vcharge::CalibrationImage> images = readImages(folder);
  vcharge::IntrinsicCalibration result;
  {
    vcharge::ProgressBar progress("calibrating " + camera_name);
    result =
        vcharge::calibrateIntrinsics(board, images, options, [&](double share) { progress.update(share); });
  }
  for (const vcharge::RejectedImage& image : result.rejected) {
    std::printf("left out %s: %s\n", image.name.c_str(), image.reason.c_str());
  }
  if (result.verdict == vcharge::Verdict::kFail) {
    throw vcharge::InputError(folder + ": FAIL: " + result.remarks.front());
  }
  print(result);
  std::printf("%s\n", result.verdict == vcharge::Verdict::kPass ? "PASS" : "WARN");
  for (const std::string& remark : result.remarks) {
    std::printf("  %s\n", remark.c_str());
  }
  vcharge::CameraRig rig;
  rig.cameras.push_back({camera_name, "camera_" + camera_name + "_optical", result.image_size_px,
                         *result.model,
                         field_of_view_rad > 0.0 ? field_of_view_rad : 2.0 * result.max_angle_rad});
  vcharge::writeCameraRig(rig, output);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Calibrates the intrinsics of a camera from images of a chessboard and writes them as a rig.yaml "
      "without "
      "extrinsics. Prints every parameter with its standard deviation, the images left out and why, and a "
      "verdict.");
  std::string folder;
  std::string size = "9x6";
  std::string camera_name = "front";
  std::string output;
  double square_m = 0.1;
  double field_of_view_rad = 0.0;
  vcharge::IntrinsicCalibrationOptions options;
  app.add_option("--images", folder, "folder of images")->required();
  app.add_option("--board", size, "inner corners, COLUMNSxROWS")->capture_default_str();
  app.add_option("--square_m,--square-m", square_m, "side of a square")->capture_default_str();
  app.add_option("--camera", camera_name, "name of the camera")->capture_default_str();
  app.add_option("--model", options.model, "mei, kannala_brandt or pinhole")->capture_default_str();
  app.add_option("--field-of-view-rad", field_of_view_rad, "full angle; 0: as far as corners were seen")
      ->capture_default_str();
  app.add_option("--output", output, "rig.yaml to write")->required()->check(vcharge::requireNotEmpty);
  return vcharge::runTool(&app, argc, argv, [&] {
    if (!vcharge::isCameraName(camera_name)) {
      throw vcharge::InputError("--camera: expected a letter, then letters, digits and underscores, got '" +
                                camera_name + "'");
    }
    calibrate(folder, vcharge::CalibrationBoard::parse(size, square_m), camera_name, field_of_view_rad, options,
              output);
  });
}
