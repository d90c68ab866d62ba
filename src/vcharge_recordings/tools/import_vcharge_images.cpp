#include <string>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/progress_bar.h"
#include "vcharge_recordings/drive_bag_writer.h"
#include "vcharge_recordings/vcharge_recording.h"

namespace {

cv::Mat readGray(const vcharge::VchargeRecording::ImageFile& file, const vcharge::RigCamera& camera) {
  const cv::Mat image = cv::imread(file.path, cv::IMREAD_GRAYSCALE);
  if (image.empty()) {
    throw vcharge::InputError(file.path + ": expected an image, cannot be read");
  }
  vcharge::checkImageSize(camera, image.size(), file.path);
  return image;
}

/// Writes both files or none: the bag gets its name once the rig is written.
void writeDriveAndRig(const vcharge::VchargeRecording& recording, const std::string& path,
                      const std::string& rig_path) {
  vcharge::DriveBagWriter writer(path, recording.rig);
  vcharge::ProgressBar progress("writing " + path);
  auto odometry = recording.odometry.begin();
  for (size_t i = 0; i < recording.images.size(); ++i) {
    const auto& image = recording.images[i];
    for (; odometry != recording.odometry.end() && odometry->stamp <= image.stamp; ++odometry) {
      writer.writeOdometry(*odometry);
    }
    writer.writeImage(0, image.stamp, readGray(image, recording.rig.cameras[0]));
    progress.update(static_cast<double>(i + 1) / static_cast<double>(recording.images.size()));
  }
  for (; odometry != recording.odometry.end(); ++odometry) {
    writer.writeOdometry(*odometry);
  }
  vcharge::writeCameraRig(recording.rig, rig_path);
  writer.close();
}

}  // namespace

int main(int argc, char** argv) {
  vcharge::CommandLine app(
      "Turns the published V-Charge images (calib.txt, system_poses.txt, images.txt and the images) into a "
      "drive: "
      "a bag with images, camera_info and /odom, and the rig.yaml of its camera. base_link is put on the "
      "ground.");
  std::string folder, output, rig;
  vcharge::VchargeRecordingOptions options;
  bool no_mask = false;
  app.addOption("--folder", &folder, "folder of the images").required();
  app.addOption("--output", &output, "bag to write").required().check(vcharge::requireOutput);
  app.addOption("--rig", &rig, "rig.yaml to write; the mask goes beside it")
      .required()
      .check(vcharge::requireOutput);
  app.addOption("--camera", &options.camera_name, "name of the camera").showDefault();
  app.addOption("--field-of-view-rad", &options.field_of_view_rad, "full angle").showDefault();
  app.addOption("--ground-height-m", &options.ground_height_m,
                "ground plane in the recording's vehicle frame: z = height + slope_x x + slope_y y")
      .showDefault();
  app.addOption("--ground-slope-x", &options.ground_slope_x).showDefault();
  app.addOption("--ground-slope-y", &options.ground_slope_y).showDefault();
  app.addFlag("--no-mask", &no_mask, "do not mask the car's body");
  app.setFooter("Keys of --json: num_images, num_odometry.");
  return vcharge::runTool(&app, argc, argv, [&](nlohmann::json* found) {
    options.mask_vehicle = !no_mask;
    const vcharge::VchargeRecording recording = vcharge::readVchargeRecording(folder, options);
    writeDriveAndRig(recording, output, rig);
    *found = {{"num_images", recording.images.size()}, {"num_odometry", recording.odometry.size()}};
  });
}
