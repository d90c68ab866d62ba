#include <cstdio>
#include <string>
#include <vector>

#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_calibration/report/calibration_files.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_recordings/bag_images.h"
#include "vcharge_ros/drive_topics.h"

namespace {

constexpr double kDegrees = 57.29577951308232;

struct Arguments {
  std::string images, bag, topic, target, options;
  std::string board = "9x6";
  double square_m = 0.1;
  int max_images = 150;
  vcharge::CalibrationOutput output{"front", 0.0, "", false, ""};
};

std::vector<vcharge::CalibrationImage> readBag(const Arguments& arguments) {
  const std::string topic = arguments.topic.empty()
                                ? vcharge::DriveTopics().imageTopic(arguments.output.camera_name)
                                : arguments.topic;
  vcharge::ProgressBar progress("reading " + topic);
  std::vector<vcharge::CalibrationImage> images;
  for (const vcharge::StampedImage& image : vcharge::readBagImages(
           arguments.bag, topic, arguments.max_images, [&](double fraction) { progress.update(fraction); })) {
    images.push_back({toString(image.stamp), image.image.pixels.clone()});
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
      "views excluded from the fit; corners up to %.0f degrees from the axis on %.0f %% of the image\n",
      result.views.size(), result.rejected.size(), result.rms_px, result.mean_error_px,
      result.cross_validated_px, kDegrees * result.max_angle_rad, 100.0 * result.covered_fraction);
  if (result.bent_boards) {
    std::printf(
        "the board bends by %.1f mm (RMS); with flat boards, the error is %.3f px RMS per coordinate\n",
        1000.0 * result.bending_m, result.flat_rms_px);
  }
}

nlohmann::json toJson(const vcharge::IntrinsicCalibration& result) {
  nlohmann::json json = {{"verdict", toString(result.verdict)},
                         {"remarks", result.remarks},
                         {"num_images", result.views.size()},
                         {"rejected", nlohmann::json::array()},
                         {"rms_px", result.rms_px},
                         {"mean_error_px", result.mean_error_px},
                         {"cross_validated_px", result.cross_validated_px},
                         {"covered_ratio", result.covered_fraction},
                         {"max_angle_rad", result.max_angle_rad}};
  for (const vcharge::RejectedImage& image : result.rejected) {
    json["rejected"].push_back({{"name", image.name}, {"reason", image.reason}});
  }
  if (result.bent_boards) {
    json["bending_m"] = result.bending_m;
    json["flat_rms_px"] = result.flat_rms_px;
  }
  if (result.model) {
    const std::vector<std::string> names = result.model->parameterNames();
    const Eigen::VectorXd values = result.model->parameters();
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      json["parameters"][names[static_cast<size_t>(i)]] = values[i];
      if (i < result.standard_deviations.size()) {
        json["standard_deviations"][names[static_cast<size_t>(i)]] = result.standard_deviations[i];
      }
    }
  }
  return json;
}

void calibrate(const Arguments& arguments, const vcharge::IntrinsicCalibrationOptions& options,
               nlohmann::json* found) {
  const vcharge::CalibrationBoard board =
      arguments.target.empty() ? vcharge::CalibrationBoard::parse(arguments.board, arguments.square_m)
                               : vcharge::readCalibrationBoard(arguments.target);
  const std::vector<vcharge::CalibrationImage> images =
      arguments.bag.empty() ? vcharge::readCalibrationImages(arguments.images) : readBag(arguments);
  vcharge::IntrinsicCalibration result;
  {
    vcharge::ProgressBar progress("calibrating " + arguments.output.camera_name);
    result = vcharge::calibrateIntrinsics(board, images, options,
                                          [&](double fraction) { progress.update(fraction); });
  }
  for (const vcharge::RejectedImage& image : result.rejected) {
    std::printf("left out %s: %s\n", image.name.c_str(), image.reason.c_str());
  }
  *found = toJson(result);
  vcharge::writeCalibration(arguments.output, board, images, result);
  if (result.verdict == vcharge::Verdict::kFail) {
    throw vcharge::InputError((arguments.bag.empty() ? arguments.images : arguments.bag) +
                              ": FAIL: " + result.remarks.front());
  }
  print(result);
  std::printf("%s\n", toString(result.verdict).c_str());
  for (const std::string& remark : result.remarks) {
    std::printf("  %s\n", remark.c_str());
  }
}

}  // namespace

int main(int argc, char** argv) {
  vcharge::CommandLine app(
      "Calibrates the intrinsics of a camera from images of a chessboard or an AprilGrid, in a folder or a "
      "bag, and writes them as a rig.yaml without extrinsics. Prints every parameter with its standard "
      "deviation, the images left out and why, and a verdict: PASS, WARN with what is missing, or FAIL, "
      "which "
      "writes no rig.yaml.");
  Arguments arguments;
  vcharge::IntrinsicCalibrationOptions options;
  auto images = app.addOption("--images", &arguments.images, "folder of images");
  const auto bag = app.addOption("--bag", &arguments.bag, "bag with the camera's images");
  images.excludes(bag);
  app.addOption("--topic", &arguments.topic,
                "topic of the images in the bag; default: /camera/CAMERA/image_raw")
      .needs(bag);
  app.addOption("--max-images", &arguments.max_images, "number of images taken from the bag, evenly spread")
      .needs(bag)
      .inRange(1, 10000)
      .showDefault();
  app.addOption("--board", &arguments.board, "inner corners of the chessboard, COLUMNSxROWS").showDefault();
  app.addOption("--square_m,--square-m", &arguments.square_m, "side of a square").showDefault();
  app.addOption("--target", &arguments.target,
                "Kalibr's target YAML (aprilgrid, checkerboard), instead of --board");
  app.addOption("--camera", &arguments.output.camera_name, "name of the camera").showDefault();
  const auto model_option =
      app.addOption("--model", &options.model, "mei, kannala_brandt or pinhole").showDefault();
  app.addOption("--options", &arguments.options, "YAML with other options of the calibration");
  app.addOption("--field-of-view-rad", &arguments.output.field_of_view_rad,
                "full field of view; 0: as far as corners were detected")
      .showDefault()
      .inRange(0.0, 6.28);
  app.addOption("--output", &arguments.output.rig_file, "rig.yaml to write")
      .required()
      .check(vcharge::requireOutput);
  app.addFlag("--keep-others", &arguments.output.keep_others,
              "keep the other cameras of an existing rig.yaml");
  app.addOption("--report", &arguments.output.report_file, "HTML report to write")
      .check(vcharge::requireOutput);
  app.setFooter(
      "Keys of --json: verdict (PASS, WARN, FAIL), remarks, num_images, rejected (name, reason), parameters "
      "and standard_deviations (by name), rms_px (per coordinate), mean_error_px, cross_validated_px, "
      "covered_ratio, max_angle_rad, bending_m and flat_rms_px (where the board bends).");
  return vcharge::runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (arguments.images.empty() && arguments.bag.empty()) {
      throw vcharge::InputError("--images or --bag is required");
    }
    if (!vcharge::isCameraName(arguments.output.camera_name)) {
      throw vcharge::InputError("--camera: expected a letter, then letters, digits and underscores, got '" +
                                arguments.output.camera_name + "'");
    }
    if (!arguments.options.empty()) {
      const std::string model = options.model;
      vcharge::readFieldsFromFile(arguments.options, &options);
      if (model_option.isGiven()) {
        options.model = model;
      }
    }
    calibrate(arguments, options, found);
  });
}
