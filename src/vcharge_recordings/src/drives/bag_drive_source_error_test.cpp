// Errors of BagDriveSource for faulty bags.
#include <fstream>
#include <limits>
#include <random>

#include <std_msgs/String.h>

#include "drives/bag_drive_source_test_support.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

using testing::BagDriveSourceTest;
using testing::expectInputError;
using testing::makeOdometry;
using testing::makePixels;
using testing::milliseconds;

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
  for (const double fraction : {0.001, 0.01, 0.1, 0.3, 0.5, 0.9, 0.99, 0.9999}) {
    SCOPED_TRACE(fraction);
    writeTextFileAtomically(
        path_, whole.substr(0, static_cast<size_t>(fraction * static_cast<double>(whole.size()))));
    expectInputError([&] { read(); }, {path_, "expected"});
  }
}

TEST_F(BagDriveSourceTest, NamesABagThatWasNotFinished) {
  writeDrive(1);
  std::filesystem::copy_file(path_, folder_ / "whole.bag");
  // A recorder that was killed: the index position in the file's header is still 0.
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

TEST_F(BagDriveSourceTest, NamesACameraThatStopsAlsoWhereOdometryOutlivesTheOthers) {
  writeBag([&] {
    for (int time_ms = 0; time_ms <= 8000; time_ms += 80) {
      writeOdometry(time_ms);
      if (time_ms <= 4000) {
        writeImage("left", time_ms);
      }
      if (time_ms <= 1600) {
        writeImage("front", time_ms);
      }
    }
  });
  expectInputError([&] { read(); }, {path_, "/camera/front/image_raw", "no image"});
}

TEST_F(BagDriveSourceTest, NamesAPauseOfAllCameras) {
  writeBag([&] {
    writeFrame(0);
    for (int time_ms = 20; time_ms < 2100; time_ms += 20) {
      writeOdometry(time_ms);
    }
    writeFrame(2100);
  });
  expectInputError([&] { read(); }, {path_, "/camera/front/image_raw", "no image"});
}

TEST_F(BagDriveSourceTest, RefusesOptionsOutOfRange) {
  BagDriveSourceOptions options;
  options.topics.image = "/image";
  EXPECT_THROW(BagDriveSource(path_, rig_, options), std::invalid_argument);
  options = BagDriveSourceOptions();
  options.max_image_gap_s = 0.0;
  EXPECT_THROW(BagDriveSource(path_, rig_, options), std::invalid_argument);
  options = BagDriveSourceOptions();
  options.sort_window_s = std::numeric_limits<double>::infinity();
  EXPECT_THROW(BagDriveSource(path_, rig_, options), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
