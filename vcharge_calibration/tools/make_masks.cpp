#include <cmath>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_calibration/masks/body_mask_estimator.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_recordings/bag_drive_source.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string bag, rig, output, report, options;
};

BodyMasks findMasks(const Arguments& arguments, const std::shared_ptr<const CameraRig>& rig,
                    const BodyMaskOptions& options) {
  BodyMaskEstimator estimator(rig, options);
  BagDriveSourceOptions source_options;
  source_options.max_image_gap_s = INFINITY;  // frames that lack a camera are used
  BagDriveSource source(arguments.bag, rig, source_options);
  ProgressBar bar("following the drive");
  source.run(&estimator, [&](double fraction) { bar.update(fraction); });
  return estimator.result();
}

void print(const BodyMasks& masks) {
  std::printf("%d images per camera from %.1f m, headings over %.0f degrees\n", masks.num_samples,
              masks.distance_m, masks.heading_range_rad * 180.0 / 3.14159265358979);
  for (const CameraBodyMask& camera : masks.cameras) {
    std::printf("%s: %s", camera.camera.c_str(), toString(camera.verdict).c_str());
    if (camera.verdict != Verdict::kFail) {
      std::printf(": %.1f %% of the field of view hidden", 100.0 * camera.body_fraction);
    }
    for (const std::string& remark : camera.remarks) {
      std::printf("; %s", remark.c_str());
    }
    std::printf("\n");
  }
}

nlohmann::json toJson(const BodyMasks& masks) {
  nlohmann::json cameras = nlohmann::json::array();
  for (const CameraBodyMask& camera : masks.cameras) {
    cameras.push_back({{"name", camera.camera},
                       {"verdict", toString(camera.verdict)},
                       {"remarks", camera.remarks},
                       {"body_fraction", camera.body_fraction},
                       {"spot_fraction", camera.spot_fraction}});
  }
  return {{"verdict", toString(masks.verdict)},
          {"distance_m", masks.distance_m},
          {"heading_range_rad", masks.heading_range_rad},
          {"num_samples", masks.num_samples},
          {"cameras", cameras}};
}

void writePictures(const BodyMasks& masks, const std::string& folder) {
  FolderTransaction transaction(folder);
  for (const CameraBodyMask& camera : masks.cameras) {
    const std::string path = transaction.path() + "/" + camera.camera + ".png";
    if (!camera.picture.empty() && !cv::imwrite(path, camera.picture)) {
      throw InputError(path + ": cannot be written");
    }
  }
  transaction.commit();
}

void makeMasks(const Arguments& arguments, const BodyMaskOptions& options, nlohmann::json* found) {
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  const BodyMasks masks = findMasks(arguments, rig, options);
  *found = toJson(masks);
  print(masks);
  if (!arguments.report.empty()) {
    writePictures(masks, arguments.report);
  }
  CameraRig masked = *rig;
  for (size_t i = 0; i < masked.cameras.size(); ++i) {
    const CameraBodyMask& camera = masks.cameras[i];
    if (camera.verdict == Verdict::kFail) {
      throw InputError(arguments.bag + ": FAIL: " + camera.camera + ": " + camera.remarks.front());
    }
    masked.cameras[i].mask = camera.mask;
    masked.cameras[i].mask_file.clear();
  }
  writeCameraRig(masked, arguments.output);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Finds the pixels of each camera that show the body of the own car, from a drive of 20 m or more with "
      "turns, and writes the rig with masks, which are 0 there. The rig needs intrinsics, but no extrinsics. "
      "Masks of the given rig are replaced. Prints a verdict for each camera: PASS, WARN with a reason, or "
      "FAIL, which writes no rig.");
  Arguments arguments;
  bool show_options = false;
  app.addOption("--bag", &arguments.bag, "drive with images and /odom").required();
  app.addOption("--rig", &arguments.rig, "rig.yaml with intrinsics").required();
  app.addOption("--output", &arguments.output,
                "rig.yaml to write, with masks beside it; may be that of --rig")
      .required()
      .check(requireOutput);
  app.addOption(
         "--report", &arguments.report,
         "folder for a picture of each camera: mean image with the body in red and dirt in blue; static "
         "edges; moving structure")
      .check(requireOutputFolder);
  app.addOption("--options", &arguments.options, "YAML with options");
  addShowOptions(&app, &show_options);
  app.setFooter(
      "Keys of --json: verdict (PASS, WARN, FAIL), distance_m, heading_range_rad, num_samples, cameras "
      "(name, "
      "verdict, remarks; body_fraction and spot_fraction of the field of view).");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    BodyMaskOptions options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (show_options) {
      std::fputs(showOptions(options).c_str(), stdout);
      return;
    }
    makeMasks(arguments, options, found);
  });
}
