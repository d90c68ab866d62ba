#include "vcharge_ros/bag_drive_source.h"

#include <fstream>
#include <limits>
#include <random>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <std_msgs/String.h>
#include <opencv2/imgcodecs.hpp>

#include "test_support.h"
#include "vcharge_core/file_io.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_bag_writer.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge {
namespace {

using testing::expectInputError;
using testing::milliseconds;

const cv::Size kSize(32, 20);

cv::Mat makePixels(int camera, int frame) {
  cv::Mat pixels(kSize, CV_8UC1);
  for (int i = 0; i < kSize.area(); ++i) {
    pixels.data[i] = static_cast<uint8_t>(7 * i + 50 * camera + 3 * frame);
  }
  return pixels;
}

VehicleOdometry makeOdometry(int64_t time_ms) {
  return {milliseconds(time_ms), RigidTransform::planar(0.001 * static_cast<double>(time_ms), 0.0, 0.0), 1.0,
          0.0};
}

/// Notes what comes: "o<ms>", "t<ms>", "<camera>:<ms>".
class Notes : public DriveConsumer {
 public:
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    note(std::to_string(camera_index) + ":", stamp);
    images.push_back(image);
  }
  void addOdometry(const VehicleOdometry& odometry) override { note("o", odometry.stamp); }
  void addWheelTicks(const WheelTicks& ticks) override { note("t", ticks.stamp); }

  std::vector<std::string> order;
  std::vector<Timestamp> stamps;
  std::vector<Image> images;

 private:
  void note(const std::string& what, Timestamp stamp) {
    order.push_back(what + std::to_string((stamp - milliseconds(0)).count() / 1000000));
    stamps.push_back(stamp);
  }
};

class BagDriveSourceTest : public ::testing::Test {
 protected:
  const std::shared_ptr<const CameraRig> rig_ = std::make_shared<const CameraRig>(testing::makeRig(kSize));
  const testing::ScratchFolder folder_;
  const std::string path_ = folder_ / "drive.bag";

  Notes read(const BagDriveSourceOptions& options = BagDriveSourceOptions()) const {
    Notes notes;
    BagDriveSource(path_, rig_, options).run(&notes, nullptr);
    return notes;
  }

  /// Frames every 80 ms of both cameras, odometry every 20 ms.
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

  /// Writes single messages, in the order given, whatever their stamps.
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

TEST_F(BagDriveSourceTest, DeliversOdometryBeforeImagesInTheRigsOrder) {
  writeDrive(2);
  EXPECT_EQ(read().order, (std::vector<std::string>{"o0", "0:0", "1:0", "o20", "o40", "o60", "o80", "0:80",
                                                    "1:80", "o100", "o120", "o140"}));
}

TEST_F(BagDriveSourceTest, DeliversThePixelsThatWereWritten) {
  writeDrive(3);
  const Notes notes = read();
  ASSERT_EQ(notes.images.size(), 6u);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(cv::norm(notes.images[i].pixels, makePixels(i % 2, i / 2), cv::NORM_INF), 0.0);
  }
}

TEST_F(BagDriveSourceTest, ReportsProgressUpToOne) {
  writeDrive(3);
  Notes notes;
  std::vector<double> progress;
  BagDriveSource(path_, rig_).run(&notes, [&](double fraction) { progress.push_back(fraction); });
  ASSERT_FALSE(progress.empty());
  EXPECT_TRUE(std::is_sorted(progress.begin(), progress.end()));
  EXPECT_EQ(progress.back(), 1.0);
}

TEST_F(BagDriveSourceTest, SortsWhatWasRecordedOutOfOrder) {
  writeBag([&] {
    writeImage("front", 80);
    writeOdometry(160);
    writeImage("left", 80);
    writeOdometry(80);
    writeOdometry(0);
    writeImage("left", 160);
    writeImage("front", 160);
  });
  EXPECT_EQ(read().order, (std::vector<std::string>{"o0", "o80", "0:80", "1:80", "o160", "0:160", "1:160"}));
}

TEST_F(BagDriveSourceTest, DeliversWheelTicksAfterOdometryAndNeverTheTruth) {
  DriveBagWriter writer(path_, *rig_);
  writer.writeGroundTruth(makeOdometry(0));
  writer.writeImage(0, milliseconds(0), makePixels(0, 0));
  writer.writeImage(1, milliseconds(0), makePixels(1, 0));
  writer.writeWheelTicks({milliseconds(0), 1, 2, 0.01, 0.0});
  writer.writeOdometry(makeOdometry(0));
  writer.close();
  EXPECT_EQ(read().order, (std::vector<std::string>{"o0", "t0", "0:0", "1:0"}));
}

TEST_F(BagDriveSourceTest, ReadsOnlyTheCamerasAskedFor) {
  writeDrive(1);
  BagDriveSourceOptions options;
  options.cameras = {"left"};
  EXPECT_EQ(read(options).order, (std::vector<std::string>{"o0", "1:0", "o20", "o40", "o60"}));
  options.cameras = {"roof"};
  expectInputError([&] { read(options); }, {"roof", "front"});
}

TEST_F(BagDriveSourceTest, ReadsCompressedImages) {
  writeBag([&] {
    writeOdometry(0);
    for (const std::string camera : {"front", "left"}) {
      sensor_msgs::CompressedImage message;
      message.header.stamp = fromTimestamp(milliseconds(0));
      message.format = "png";
      cv::imencode(".png", makePixels(camera == "left" ? 1 : 0, 0), message.data);
      write("/camera/" + camera + "/image_raw/compressed", message);
    }
  });
  const Notes notes = read();
  ASSERT_EQ(notes.images.size(), 2u);
  EXPECT_EQ(cv::norm(notes.images[1].pixels, makePixels(1, 0), cv::NORM_INF), 0.0);
}

TEST_F(BagDriveSourceTest, MayBeReadTwice) {
  writeDrive(2);
  BagDriveSource source(path_, rig_);
  Notes first, second;
  source.run(&first, nullptr);
  source.run(&second, nullptr);
  EXPECT_EQ(first.order, second.order);
}

TEST_F(BagDriveSourceTest, LetsTheConsumersErrorsThrough) {
  struct Refuser : DriveConsumer {
    void addImage(size_t, Timestamp, const Image&) override { throw std::domain_error("the consumer's own"); }
    void addOdometry(const VehicleOdometry&) override {}
  } refuser;
  writeDrive(1);
  EXPECT_THROW(BagDriveSource(path_, rig_).run(&refuser, nullptr), std::domain_error);
}

TEST_F(BagDriveSourceTest, NamesABagThatIsNotThere) {
  expectInputError([&] { read(); }, {path_, "no such file"});
}

TEST_F(BagDriveSourceTest, NamesAFileThatIsNoBag) {
  writeTextFileAtomically(path_, "vehicle_frame: base_link\n");
  expectInputError([&] { read(); }, {path_, "expected a ROS bag"});
  writeTextFileAtomically(path_, "");
  expectInputError([&] { read(); }, {path_, "expected a ROS bag"});
}

TEST_F(BagDriveSourceTest, NamesABagThatIsCutOffAnywhere) {
  writeDrive(3);
  const std::string whole = readTextFile(path_);
  for (const double share : {0.001, 0.01, 0.1, 0.3, 0.5, 0.9, 0.99, 0.9999}) {
    SCOPED_TRACE(share);
    writeTextFileAtomically(path_,
                            whole.substr(0, static_cast<size_t>(share * static_cast<double>(whole.size()))));
    expectInputError([&] { read(); }, {path_, "expected"});
  }
}

TEST_F(BagDriveSourceTest, NamesABagThatWasNotFinished) {
  writeDrive(1);
  std::filesystem::copy_file(path_, folder_ / "whole.bag");
  // What a recorder that is killed leaves: the index position in the file's header is still 0.
  std::string bytes = readTextFile(path_);
  const size_t field = bytes.find("index_pos=");
  ASSERT_NE(field, std::string::npos);
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(field) + 10, 8, '\0');
  writeTextFileAtomically(path_, bytes);
  expectInputError([&] { read(); }, {path_, "no index", "rosbag reindex"});
}

TEST_F(BagDriveSourceTest, EndsInAnErrorOrAWholeDriveWhenBytesAreDamaged) {
  writeDrive(3);
  const std::string whole = readTextFile(path_);
  std::mt19937 generator(11);
  int num_errors = 0;
  for (int i = 0; i < 300; ++i) {
    std::string damaged = whole;
    for (int k = 0; k < 4; ++k) {
      damaged[generator() % damaged.size()] = static_cast<char>(generator());
    }
    std::ofstream(path_, std::ios::binary) << damaged;
    try {
      read();
    } catch (const InputError& error) {
      ++num_errors;
      EXPECT_THAT(error.what(), ::testing::HasSubstr(path_));
    }
  }
  EXPECT_GT(num_errors, 0);
}

TEST_F(BagDriveSourceTest, NamesTheTopicThatIsMissingAndThoseThereAre) {
  writeDrive(1);
  BagDriveSourceOptions options;
  options.topics.image = "/cam_{camera}/image_raw";
  expectInputError([&] { read(options); },
                   {path_, "/cam_front/image_raw", "camera 'front'", "/camera/front/image_raw", "/odom"});
  options = BagDriveSourceOptions();
  options.topics.odometry = "/odometry";
  expectInputError([&] { read(options); },
                   {path_, "/odometry", "nav_msgs/Odometry", "/odom (nav_msgs/Odometry)"});
}

TEST_F(BagDriveSourceTest, NamesACameraWithoutImages) {
  writeBag([&] {
    writeOdometry(0);
    writeImage("front", 0);
  });
  expectInputError([&] { read(); }, {path_, "camera 'left'", "/camera/left/image_raw"});
}

TEST_F(BagDriveSourceTest, NamesATopicOfAnotherType) {
  writeBag([&] {
    write("/odom", std_msgs::String());
    writeImage("front", 0);
    writeImage("left", 0);
  });
  expectInputError([&] { read(); }, {path_, "/odom", "nav_msgs/Odometry", "std_msgs/String"});
}

TEST_F(BagDriveSourceTest, NamesAnImageUnlikeTheRig) {
  writeBag([&] {
    writeFrame(0);
    writeImage("left", 80, cv::Size(16, 10));
  });
  expectInputError([&] { read(); }, {path_, "/camera/left/image_raw", "16x10", "32x20"});
}

TEST_F(BagDriveSourceTest, NamesAnEncodingItCannotTake) {
  writeBag([&] {
    writeFrame(0);
    auto message = toImageMessage(makePixels(0, 0), milliseconds(80), "frame");
    message->encoding = "yuv422";
    write("/camera/left/image_raw", *message);
  });
  expectInputError([&] { read(); }, {path_, "/camera/left/image_raw", "mono8", "yuv422"});
}

TEST_F(BagDriveSourceTest, NamesATopicWhoseStampsJumpBack) {
  for (const std::string topic : {"/odom", "/camera/left/image_raw"}) {
    writeBag([&] {
      for (int i = 0; i < 20; ++i) {
        writeFrame(80 * i);
      }
      topic == "/odom" ? writeOdometry(900) : writeImage("left", 900);
    });
    expectInputError([&] { read(); }, {path_, topic, "jumps back by 0.62 s"});
  }
}

TEST_F(BagDriveSourceTest, NamesATopicWithoutStamps) {
  writeBag([&] {
    writeFrame(0);
    nav_msgs::Odometry odometry = toMessage(makeOdometry(20), "odom", "base_link");
    odometry.header.stamp = ros::Time();
    write("/odom", odometry);
  });
  expectInputError([&] { read(); }, {path_, "/odom", "stamp"});
}

TEST_F(BagDriveSourceTest, NamesOdometryThatIsNoPose) {
  writeBag([&] {
    writeFrame(0);
    nav_msgs::Odometry odometry = toMessage(makeOdometry(20), "odom", "base_link");
    odometry.pose.pose.orientation.w = std::numeric_limits<double>::quiet_NaN();
    write("/odom", odometry);
  });
  expectInputError([&] { read(); }, {path_, "/odom", "quaternion"});
}

TEST_F(BagDriveSourceTest, NamesACameraThatStops) {
  const auto write_until = [&](int left_stops_ms) {
    writeBag([&] {
      for (int time_ms = 0; time_ms <= 4000; time_ms += 80) {
        writeOdometry(time_ms);
        writeImage("front", time_ms);
        if (time_ms < left_stops_ms) {
          writeImage("left", time_ms);
        }
      }
    });
  };
  write_until(1600);
  expectInputError([&] { read(); }, {path_, "/camera/left/image_raw", "no image", "max_image_gap_s = 2 s"});
  BagDriveSourceOptions patient;
  patient.max_image_gap_s = 10.0;
  EXPECT_NO_THROW(read(patient));
  write_until(2160);  // the last 1.92 s are missing
  EXPECT_NO_THROW(read());
}

TEST_F(BagDriveSourceTest, NamesTheOnlyCameraWhenItStopsWhileOdometryGoesOn) {
  writeBag([&] {
    writeFrame(0);
    for (int time_ms = 20; time_ms <= 2100; time_ms += 20) {
      writeOdometry(time_ms);
    }
  });
  expectInputError([&] { read(); }, {path_, "/camera/front/image_raw", "no image"});
}

TEST_F(BagDriveSourceTest, LetsOdometryBeginLongBeforeTheCameras) {
  writeBag([&] {
    for (int time_ms = 0; time_ms < 8000; time_ms += 20) {
      writeOdometry(time_ms);
    }
    writeFrame(8000);
  });
  EXPECT_NO_THROW(read());
}

TEST_F(BagDriveSourceTest, RefusesOptionsOutOfRange) {
  BagDriveSourceOptions options;
  options.topics.image = "/image";
  EXPECT_THROW(BagDriveSource(path_, rig_, options), std::invalid_argument);
  options = BagDriveSourceOptions();
  options.max_image_gap_s = 0.0;
  EXPECT_THROW(BagDriveSource(path_, rig_, options), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
