#include "vcharge_recordings/bag_drive_source.h"

#include <algorithm>

#include <sensor_msgs/CompressedImage.h>
#include <opencv2/imgcodecs.hpp>

#include "drives/bag_drive_source_test_support.h"

namespace vcharge {
namespace {

using testing::BagDriveSourceTest;
using testing::expectInputError;
using testing::makeOdometry;
using testing::makePixels;
using testing::milliseconds;
using testing::Notes;

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

TEST_F(BagDriveSourceTest, TellsWhichCamerasHaveImages) {
  writeBag([&] {
    writeImage("left", 0);
    write("/camera/roof/image_raw/compressed", sensor_msgs::CompressedImage());
  });
  CameraRig rig = *rig_;
  EXPECT_EQ(camerasWithImages(path_, rig), std::vector<std::string>{"left"});
  rig.cameras[0].name = "roof";
  EXPECT_EQ(camerasWithImages(path_, rig), (std::vector<std::string>{"roof", "left"}));
  expectInputError([&] { camerasWithImages(path_ + ".none", rig); }, {".none"});
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

TEST_F(BagDriveSourceTest, TellsWhenItWasRecorded) {
  writeDrive(3);
  const Notes notes = read();
  const auto [first, last] = BagDriveSource(path_, rig_).recordedSpan();
  EXPECT_EQ(first, milliseconds(0));
  EXPECT_GE(last, milliseconds(160));  // the last image's stamp
  EXPECT_LE(last, milliseconds(300));
}

TEST_F(BagDriveSourceTest, LetsTheConsumersErrorsThrough) {
  struct Refuser : DriveConsumer {
    void addImage(size_t, Timestamp, const Image&) override { throw std::domain_error("the consumer's own"); }
    void addOdometry(const VehicleOdometry&) override {}
  } refuser;
  writeDrive(1);
  EXPECT_THROW(BagDriveSource(path_, rig_).run(&refuser, nullptr), std::domain_error);
}

TEST_F(BagDriveSourceTest, LetsOdometryRunOnAfterAllCamerasHaveEnded) {
  writeBag([&] {
    writeFrame(0);
    writeFrame(80);
    for (int time_ms = 100; time_ms <= 8000; time_ms += 20) {
      writeOdometry(time_ms);
    }
  });
  const Notes notes = read();
  EXPECT_EQ(notes.images.size(), 4u);
  EXPECT_EQ(notes.order.back(), "o8000");
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

}  // namespace
}  // namespace vcharge
