#include "vcharge_ros/live_drive_source.h"

#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>

#include <ros/ros.h>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_ros/conversions.h"
#include "vcharge_ros/image_conversions.h"
#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::kSize;
using testing::makeOdometry;
using testing::milliseconds;
using ::testing::Not;
using testing::Notes;

constexpr int kPeriod_ms = 80;
constexpr double kForever_s = 1e6;
constexpr int kFront = 0;
constexpr int kLeft = 1;

/// Publishes and receives in one thread: messages published by pointer before waitFor() arrive in
/// order.
class LiveDriveSourceTest : public ::testing::Test {
 protected:
  LiveDriveSourceTest() {
    for (const RigCamera& camera : rig_->cameras) {
      raw_.push_back(node_.advertise<sensor_msgs::Image>(topics_.imageTopic(camera.name), 1000));
      compressed_.push_back(
          node_.advertise<sensor_msgs::CompressedImage>(topics_.compressedImageTopic(camera.name), 1000));
    }
    odometry_ = node_.advertise<nav_msgs::Odometry>(topics_.odometry, 1000);
    options_.image_queue_size = 0;  // the tests publish faster than any camera
    options_.max_silence_s = kForever_s;
  }

  /// Starts a source that feeds `consumer`.
  std::unique_ptr<LiveDriveSource> start(DriveConsumer* consumer) {
    auto source = std::make_unique<LiveDriveSource>(node_, rig_, options_);
    source->run(consumer, DriveSource::ProgressCallback());
    waitFor([&] { return odometry_.getNumSubscribers() > 0; });
    return source;
  }

  static void waitFor(const std::function<bool()>& condition) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(20.0);
    while (!condition()) {
      if (ros::WallTime::now() > end) {
        throw std::runtime_error("waited in vain");
      }
      ros::spinOnce();
      ros::WallDuration(0.002).sleep();
    }
  }
  /// Everything published before is delivered once `notes` has the odometry that is published here.
  void waitForAll(const Notes& notes, int64_t time_ms) {
    publishOdometry(time_ms);
    const std::string last = "o" + std::to_string(time_ms);
    waitFor([&] { return !notes.order.empty() && notes.order.back() == last; });
  }

  static nav_msgs::OdometryPtr odometryMessage(int64_t time_ms) {
    return boost::make_shared<nav_msgs::Odometry>(toMessage(makeOdometry(time_ms), "odom", "base_link"));
  }
  void publishOdometry(int64_t time_ms) { odometry_.publish(odometryMessage(time_ms)); }
  static cv::Mat pixelsOf(int camera, int64_t time_ms, bool is_raw) {
    const cv::Mat pixels = testing::makePixels(camera, static_cast<int>(time_ms / kPeriod_ms));
    return is_raw ? pixels : cv::Mat(255 - pixels);
  }
  void publishRaw(int camera, int64_t time_ms) {
    raw_[camera].publish(toImageMessage(pixelsOf(camera, time_ms, true), milliseconds(time_ms), "frame"));
  }
  void publishCompressed(int camera, int64_t time_ms) {
    const auto message = boost::make_shared<sensor_msgs::CompressedImage>();
    message->header.stamp = fromTimestamp(milliseconds(time_ms));
    message->format = "png";
    cv::imencode(".png", pixelsOf(camera, time_ms, false), message->data);
    compressed_[camera].publish(message);
  }
  /// Expects that the i-th image of `notes` was published with these values.
  static bool is(const Notes& notes, size_t i, int camera, int64_t time_ms, bool is_raw) {
    return cv::norm(notes.images.at(i).pixels, pixelsOf(camera, time_ms, is_raw), cv::NORM_INF) == 0.0;
  }

  ros::NodeHandle node_;
  const std::shared_ptr<const CameraRig> rig_ = std::make_shared<const CameraRig>(testing::makeRig(kSize));
  const DriveTopics topics_;
  LiveDriveSourceOptions options_;
  std::vector<ros::Publisher> raw_, compressed_;  // one per camera
  ros::Publisher odometry_;
};

TEST_F(LiveDriveSourceTest, TakesRawImagesAndLeavesTheirCompressedTwins) {
  Notes notes;
  const auto source = start(&notes);
  for (const int time_ms : {0, 80, 160}) {
    for (const int camera : {kFront, kLeft}) {
      publishRaw(camera, time_ms);
      publishCompressed(camera, time_ms);
    }
  }
  waitForAll(notes, 200);
  EXPECT_THAT(notes.order, ElementsAre("0:0", "1:0", "0:80", "1:80", "0:160", "1:160", "o200"));
  for (size_t i = 0; i < notes.images.size(); ++i) {
    EXPECT_TRUE(is(notes, i, static_cast<int>(i % 2), static_cast<int64_t>(i / 2) * kPeriod_ms, true));
  }
}

TEST_F(LiveDriveSourceTest, TakesCompressedImagesFromACameraThatSendsNothingElse) {
  Notes notes;
  const auto source = start(&notes);
  publishRaw(kFront, 0);
  publishCompressed(kLeft, 0);
  publishRaw(kFront, 80);
  publishCompressed(kLeft, 80);
  waitForAll(notes, 100);
  EXPECT_THAT(notes.order, ElementsAre("0:0", "1:0", "0:80", "1:80", "o100"));
  EXPECT_TRUE(is(notes, 2, kFront, 80, true));
  EXPECT_TRUE(is(notes, 3, kLeft, 80, false));
}

TEST_F(LiveDriveSourceTest, DeliversAnImageOnceWhenItsCompressedTwinComesFirst) {
  Notes notes;
  const auto source = start(&notes);
  publishCompressed(kFront, 0);
  publishRaw(kFront, 0);
  publishCompressed(kFront, 80);
  publishRaw(kFront, 80);
  waitForAll(notes, 100);
  EXPECT_THAT(notes.order, ElementsAre("0:0", "0:80", "o100"));
  EXPECT_TRUE(is(notes, 1, kFront, 80, true));
}

TEST_F(LiveDriveSourceTest, TurnsToCompressedImagesWhenRawOnesStopAndBackWhenTheyReturn) {
  options_.max_silence_s = 1.0;
  Notes notes;
  const auto source = start(&notes);
  publishRaw(kFront, 0);
  for (int time_ms = 0; time_ms <= 1280; time_ms += kPeriod_ms) {
    publishCompressed(kFront, time_ms);  // 1.0 s after the last raw image compressed ones are used
  }
  publishRaw(kFront, 1360);
  publishCompressed(kFront, 1360);
  publishRaw(kFront, 1440);
  waitForAll(notes, 1500);
  EXPECT_THAT(notes.order,
              ElementsAre("0:0", "0:1040", "0:1120", "0:1200", "0:1280", "0:1360", "0:1440", "o1500"));
  EXPECT_TRUE(is(notes, 0, kFront, 0, true));
  EXPECT_TRUE(is(notes, 4, kFront, 1280, false));
  EXPECT_TRUE(is(notes, 5, kFront, 1360, true));
}

TEST_F(LiveDriveSourceTest, SubscribesOnlyToWhatTheOptionsName) {
  Notes notes;
  options_.cameras = {"left"};
  options_.image_transport = ImageTransport::kRaw;
  auto source = start(&notes);
  waitFor([&] { return raw_[kLeft].getNumSubscribers() == 1; });
  EXPECT_EQ(raw_[kFront].getNumSubscribers(), 0u);
  EXPECT_EQ(compressed_[kLeft].getNumSubscribers(), 0u);
  source.reset();
  options_.image_transport = ImageTransport::kCompressed;
  source = start(&notes);
  waitFor([&] { return compressed_[kLeft].getNumSubscribers() == 1; });
  EXPECT_EQ(raw_[kLeft].getNumSubscribers(), 0u);
  publishCompressed(kLeft, 80);
  waitForAll(notes, 100);
  EXPECT_THAT(notes.order, ElementsAre("1:80", "o100"));
}

TEST_F(LiveDriveSourceTest, DeliversAsThingsArriveWithoutAWindow) {
  Notes notes;
  const auto source = start(&notes);
  publishRaw(kLeft, 80);
  publishOdometry(80);
  publishOdometry(60);
  waitForAll(notes, 100);
  EXPECT_THAT(notes.order, ElementsAre("1:80", "o80", "o60", "o100"));
}

TEST_F(LiveDriveSourceTest, SortsThroughAWindowAndDeliversTheLastOnceNothingComes) {
  options_.sort_window_s = 0.1;
  options_.idle_flush_s = kForever_s;
  Notes waiting, flushed;
  const auto patient = start(&waiting);
  options_.idle_flush_s = 0.1;
  const auto impatient = start(&flushed);
  for (const int time_ms : {0, 80, 160, 240}) {
    publishRaw(kLeft, time_ms);
    publishRaw(kFront, time_ms);
    publishOdometry(time_ms);
  }
  waitFor([&] { return flushed.order.size() == 12; });
  EXPECT_THAT(flushed.order, ElementsAre("o0", "0:0", "1:0", "o80", "0:80", "1:80", "o160", "0:160", "1:160",
                                         "o240", "0:240", "1:240"));
  EXPECT_THAT(waiting.order, ElementsAre("o0", "0:0", "1:0", "o80", "0:80", "1:80"))
      << "what is less than a window older than the newest";
  patient->flush();
  EXPECT_EQ(waiting.order, flushed.order);
}

TEST_F(LiveDriveSourceTest, PassesStampsThatJumpBackOnAndReportsThem) {
  for (const double window_s : {0.0, 0.1}) {
    options_.sort_window_s = window_s;
    options_.idle_flush_s = 0.1;
    Notes notes;
    const auto source = start(&notes);
    for (const int time_ms : {5000, 5020, 0, 20}) {  // a replayed bag
      publishOdometry(time_ms);
    }
    waitFor([&] { return notes.order.size() == 4; });
    EXPECT_THAT(notes.order, ElementsAre("o5000", "o5020", "o0", "o20"));
    const DriveMonitor::Report report = source->report();
    EXPECT_EQ(report.level, DriveMonitor::Level::kWarn);
    EXPECT_THAT(report.message, HasSubstr("/odom: stamp"));
    EXPECT_THAT(report.message, HasSubstr("jumped back by 5.0 s"));
  }
}

TEST_F(LiveDriveSourceTest, SkipsBadMessagesReportsThemAndRecovers) {
  Notes notes;
  const auto source = start(&notes);
  raw_[kLeft].publish(toImageMessage(cv::Mat(10, 16, CV_8UC1, cv::Scalar(0)), milliseconds(0), "frame"));
  const auto garbage = boost::make_shared<sensor_msgs::CompressedImage>();
  garbage->header.stamp = fromTimestamp(milliseconds(0));
  garbage->data.assign(100, 7);
  compressed_[kFront].publish(garbage);
  const nav_msgs::OdometryPtr bad = odometryMessage(0);
  bad->pose.pose.position.x = std::numeric_limits<double>::quiet_NaN();
  odometry_.publish(bad);
  publishRaw(kLeft, 80);
  publishRaw(kFront, 80);
  waitForAll(notes, 100);
  EXPECT_THAT(notes.order, ElementsAre("1:80", "0:80", "o100"));
  const DriveMonitor::Report report = source->report();
  EXPECT_EQ(report.level, DriveMonitor::Level::kError);
  for (const char* part : {"/camera/left/image_raw", "16x10", "32x20", "/camera/front/image_raw", "/odom"}) {
    EXPECT_THAT(report.message, HasSubstr(part));
  }
  EXPECT_EQ(source->report().level, DriveMonitor::Level::kOk) << "good data came, and it was told once";
}

TEST_F(LiveDriveSourceTest, RefusesMessagesWithoutAStamp) {
  Notes notes;
  const auto source = start(&notes);
  const nav_msgs::OdometryPtr bad = odometryMessage(0);
  bad->header.stamp = ros::Time();
  odometry_.publish(bad);
  waitForAll(notes, 20);
  EXPECT_THAT(notes.order, ElementsAre("o20"));
  EXPECT_THAT(source->report().message, HasSubstr("/odom: expected a stamp"));
}

TEST_F(LiveDriveSourceTest, NamesTheTopicsThatAreSilent) {
  options_.max_silence_s = 0.05;
  Notes notes;
  const auto source = start(&notes);
  waitFor([&] {
    publishOdometry(20);
    const std::string message = source->report().message;
    return message.find("/camera/front/image_raw: no data for") != std::string::npos &&
           message.find("/camera/left/image_raw: no data for") != std::string::npos &&
           message.find("/odom: no data") == std::string::npos;
  });
}

TEST_F(LiveDriveSourceTest, ReportsWhileTheConsumerIsAtWork) {
  options_.max_silence_s = 0.3;
  struct SlowNotes : Notes {
    void addOdometry(const VehicleOdometry& odometry) override {
      Notes::addOdometry(odometry);
      ros::WallDuration(0.4).sleep();
      reports.push_back(source->report());
    }
    LiveDriveSource* source = nullptr;
    std::vector<DriveMonitor::Report> reports;
  } notes;
  const auto source = start(&notes);
  notes.source = source.get();
  publishOdometry(5000);
  publishOdometry(0);
  waitFor([&] { return notes.reports.size() == 2; });
  EXPECT_THAT(notes.reports[0].message, Not(HasSubstr("/odom"))) << "busy, not silent";
  EXPECT_THAT(notes.reports[1].message, HasSubstr("jumped back by 5.0 s"));
}

TEST_F(LiveDriveSourceTest, OutlivesAConsumerThatThrows) {
  struct Refuser : Notes {
    void addImage(size_t, Timestamp, const Image&) override { throw std::domain_error("cannot take it"); }
  } refuser;
  const auto source = start(&refuser);
  publishRaw(kFront, 0);
  waitForAll(refuser, 20);
  EXPECT_THAT(refuser.order, ElementsAre("o20"));
  EXPECT_THAT(source->report().message, HasSubstr("cannot take it"));
}

TEST_F(LiveDriveSourceTest, DeliversNothingOnceItIsDestroyed) {
  Notes notes, witness;
  auto source = start(&notes);
  const auto other = start(&witness);
  publishOdometry(0);
  source.reset();
  waitForAll(witness, 20);
  EXPECT_THAT(witness.order, ElementsAre("o0", "o20"));
  EXPECT_TRUE(notes.order.empty());
}

TEST_F(LiveDriveSourceTest, RefusesBadOptionsUnknownCamerasAndASecondRun) {
  Notes notes;
  const auto source = start(&notes);
  EXPECT_THROW(source->run(&notes, DriveSource::ProgressCallback()), std::logic_error);
  options_.cameras = {"roof"};
  testing::expectInputError([&] { LiveDriveSource(node_, rig_, options_); }, {"roof", "front"});
  options_ = LiveDriveSourceOptions();
  options_.sort_window_s = std::numeric_limits<double>::infinity();
  EXPECT_THROW(LiveDriveSource(node_, rig_, options_), std::invalid_argument);
  options_ = LiveDriveSourceOptions();
  options_.idle_flush_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(LiveDriveSource(node_, rig_, options_), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "live_drive_source_test");
  return RUN_ALL_TESTS();
}
