#pragma once

#include <memory>
#include <string>
#include <vector>

#include <rosbag/bag.h>
#include <opencv2/core.hpp>

#include "vcharge_recordings/bag_drive_source.h"
#include "vcharge_recordings/drive_bag_writer.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/image_conversions.h"
#include "vcharge_ros/test_support.h"

namespace vcharge::testing {

class BagDriveSourceTest : public ::testing::Test {
 protected:
  const std::shared_ptr<const CameraRig> rig_ = std::make_shared<const CameraRig>(makeRig(kSize));
  const ScratchFolder folder_;
  const std::string path_ = folder_ / "drive.bag";

  Notes read(const BagDriveSourceOptions& options = BagDriveSourceOptions()) const {
    Notes notes;
    BagDriveSource(path_, rig_, options).run(&notes, nullptr);
    return notes;
  }

  /// Writes frames of both cameras every 80 ms and odometry every 20 ms.
  void writeDrive(int num_frames) const {
    DriveBagWriter writer(path_, *rig_);
    for (int i = 0; i < num_frames; ++i) {
      for (int k = 0; k < 4; ++k) {
        writer.writeOdometry(makeOdometry(80 * i + 20 * k));
      }
      writer.writeImage(1, milliseconds(80 * i), makePixels(1, i));
      writer.writeImage(0, milliseconds(80 * i), makePixels(0, i));
    }
    writer.close();
  }

  /// Writes single messages in the given order, with any stamps.
  template <class Function>
  void writeBag(Function&& function) {
    rosbag::Bag bag(path_, rosbag::bagmode::Write);
    bag_ = &bag;
    record_time_ms_ = 0;
    function();
    bag.close();
  }
  template <class Message>
  void write(const std::string& topic, const Message& message) {
    bag_->write(topic, fromTimestamp(milliseconds(record_time_ms_++)), message);
  }
  void writeOdometry(int64_t time_ms) {
    write("/odom", toMessage(makeOdometry(time_ms), "odom", "base_link"));
  }
  void writeImage(const std::string& camera, int64_t time_ms, cv::Size size = kSize) {
    write("/camera/" + camera + "/image_raw",
          *toImageMessage(cv::Mat(size, CV_8UC1, cv::Scalar(9)), milliseconds(time_ms), "frame"));
  }
  void writeFrame(int64_t time_ms) {
    writeOdometry(time_ms);
    writeImage("front", time_ms);
    writeImage("left", time_ms);
  }

 private:
  rosbag::Bag* bag_ = nullptr;
  int64_t record_time_ms_ = 0;
};

}  // namespace vcharge::testing
