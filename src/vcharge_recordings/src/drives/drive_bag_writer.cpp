#include "vcharge_recordings/drive_bag_writer.h"

#include <filesystem>
#include <vector>

#include <rosbag/bag.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_ros/camera_info.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_topics.h"
#include "vcharge_ros/image_conversions.h"
#include "vcharge_ros/obstacle_conversions.h"

namespace vcharge {
namespace {

constexpr char kOdomFrame[] = "odom";
constexpr char kWorldFrame[] = "world";
constexpr char kGroundTruthTopic[] = "/ground_truth";
constexpr char kTrueObjectsTopic[] = "/ground_truth/objects";

}  // namespace

struct DriveBagWriter::Implementation {
  std::string path;
  std::string unfinished_path;  // the name that rosbag record gives an incomplete bag
  CameraRig rig;
  DriveTopics topics;
  std::vector<sensor_msgs::CameraInfo> camera_infos;
  rosbag::Bag bag;
  bool closed = false;

  template <class Message>
  void write(const std::string& topic, Timestamp received, const Message& message) {
    check(!closed, "DriveBagWriter: written to after close()");
    try {
      bag.write(topic, fromTimestamp(received), message);
    } catch (const rosbag::BagException& error) {
      throw InputError(path + ": cannot be written (" + error.what() + ")");
    }
  }
};

DriveBagWriter::DriveBagWriter(const std::string& path, const CameraRig& rig)
    : implementation_(std::make_unique<Implementation>()) {
  implementation_->path = path;
  implementation_->unfinished_path = path + ".active";
  implementation_->rig = rig;
  for (const RigCamera& camera : rig.cameras) {
    implementation_->camera_infos.push_back(makeCameraInfo(camera));
  }
  if (std::filesystem::is_directory(path)) {
    throw InputError(path + ": cannot be written (it is a folder)");
  }
  createFolder(std::filesystem::path(path).parent_path().string());
  try {
    implementation_->bag.open(implementation_->unfinished_path, rosbag::bagmode::Write);
  } catch (const rosbag::BagException& error) {
    throw InputError(path + ": cannot be written (" + error.what() + ")");
  }
}

DriveBagWriter::~DriveBagWriter() {
  if (implementation_->closed) {
    return;
  }
  try {
    implementation_->bag.close();
  } catch (const std::exception&) {
    // The file is removed anyway.
  }
  std::error_code ignored;
  std::filesystem::remove(implementation_->unfinished_path, ignored);
}

void DriveBagWriter::writeImage(size_t camera_index, Timestamp stamp, const cv::Mat& pixels,
                                std::optional<Timestamp> received) {
  const RigCamera& camera = implementation_->rig.cameras.at(camera_index);
  check(pixels.type() == CV_8UC1 && pixels.size() == camera.image_size_px,
        "DriveBagWriter: expected a CV_8UC1 image of the rig's size");
  sensor_msgs::CameraInfo& info = implementation_->camera_infos[camera_index];
  info.header.stamp = fromTimestamp(stamp);
  implementation_->write(implementation_->topics.imageTopic(camera.name), received.value_or(stamp),
                         toImageMessage(pixels, stamp, camera.frame_id));
  implementation_->write(implementation_->topics.cameraInfoTopic(camera.name), received.value_or(stamp),
                         info);
}

void DriveBagWriter::writeOdometry(const VehicleOdometry& odometry, std::optional<Timestamp> received) {
  implementation_->write(implementation_->topics.odometry, received.value_or(odometry.stamp),
                         toMessage(odometry, kOdomFrame, implementation_->rig.vehicle_frame));
}

void DriveBagWriter::writeWheelTicks(const WheelTicks& ticks, std::optional<Timestamp> received) {
  implementation_->write(implementation_->topics.wheel_ticks, received.value_or(ticks.stamp),
                         toMessage(ticks, implementation_->rig.vehicle_frame));
}

void DriveBagWriter::writeGroundTruth(const VehicleOdometry& truth) {
  implementation_->write(kGroundTruthTopic, truth.stamp,
                         toMessage(truth, kWorldFrame, implementation_->rig.vehicle_frame));
}

void DriveBagWriter::writeTrueObjects(Timestamp stamp, const std::vector<TrackedObject>& objects) {
  implementation_->write(kTrueObjectsTopic, stamp, toMessage(objects, stamp, kWorldFrame));
}

void DriveBagWriter::close() {
  check(!implementation_->closed, "DriveBagWriter: closed twice");
  try {
    implementation_->bag.close();
  } catch (const rosbag::BagException& error) {
    throw InputError(implementation_->path + ": cannot be written (" + error.what() + ")");
  }
  std::error_code error;
  std::filesystem::rename(implementation_->unfinished_path, implementation_->path, error);
  if (error) {
    throw InputError(implementation_->path + ": cannot be written (" + error.message() + ")");
  }
  implementation_->closed = true;
}

}  // namespace vcharge
