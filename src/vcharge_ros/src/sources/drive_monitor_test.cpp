#include "vcharge_ros/drive_monitor.h"

#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;
using testing::milliseconds;
using Level = DriveMonitor::Level;
using Change = DriveMonitor::Change;

class DriveMonitorTest : public ::testing::Test {
 protected:
  DriveMonitorTest() { monitor_.expectTopic("/odom"); }

  DriveMonitor::SteadyTime at(double seconds) const {
    return start_ + std::chrono::duration_cast<DriveMonitor::SteadyTime::duration>(
                        std::chrono::duration<double>(seconds));
  }

  const DriveMonitor::SteadyTime start_{};
  DriveMonitor monitor_{2.0, start_};
};

TEST_F(DriveMonitorTest, IsWellWhileDataComes) {
  monitor_.addGood("/odom", milliseconds(0), at(0.5));
  const DriveMonitor::Report report = monitor_.report(at(1.0));
  EXPECT_EQ(report.level, Level::kOk);
  ASSERT_FALSE(report.values.empty());
  EXPECT_EQ(report.values[0].first, "/odom");
  EXPECT_THAT(report.values[0].second, HasSubstr("1 good, 0 bad"));
}

TEST_F(DriveMonitorTest, NamesATopicThatNeverComes) {
  EXPECT_EQ(monitor_.report(at(1.9)).level, Level::kOk);
  const DriveMonitor::Report report = monitor_.report(at(2.1));
  EXPECT_EQ(report.level, Level::kError);
  EXPECT_THAT(report.message, HasSubstr("/odom: no data for 2.1 s"));
}

TEST_F(DriveMonitorTest, NamesATopicThatStopsAndForgivesItWhenItComesAgain) {
  monitor_.addGood("/odom", milliseconds(0), at(10.0));
  EXPECT_EQ(monitor_.report(at(11.0)).level, Level::kOk);
  EXPECT_EQ(monitor_.report(at(12.5)).level, Level::kError);
  monitor_.addGood("/odom", milliseconds(2600), at(12.6));
  EXPECT_EQ(monitor_.report(at(12.7)).level, Level::kOk);
}

TEST_F(DriveMonitorTest, DoesNotMissTopicsThatAreNotExpected) {
  monitor_.addGood("/wheel_ticks", milliseconds(0), at(0.0));
  monitor_.addGood("/odom", milliseconds(0), at(99.0));
  EXPECT_EQ(monitor_.report(at(100.0)).level, Level::kOk);
}

TEST_F(DriveMonitorTest, ReportsAnErrorOnceEvenIfItIsOverByThen) {
  monitor_.addGood("/odom", milliseconds(0), at(0.0));
  EXPECT_EQ(monitor_.addBad("/odom", "/odom: bad quaternion", at(0.1)), Change::kFailed);
  EXPECT_EQ(monitor_.addBad("/odom", "/odom: bad quaternion", at(0.2)), Change::kNone);
  EXPECT_EQ(monitor_.addGood("/odom", milliseconds(300), at(0.3)), Change::kRecovered);
  const DriveMonitor::Report report = monitor_.report(at(1.0));
  EXPECT_EQ(report.level, Level::kError);
  EXPECT_EQ(report.message, "/odom: bad quaternion");
  EXPECT_EQ(monitor_.report(at(1.5)).level, Level::kOk);
}

TEST_F(DriveMonitorTest, KeepsAnErrorUntilGoodDataComes) {
  monitor_.addBad("/odom", "/odom: bad quaternion", at(0.1));
  EXPECT_EQ(monitor_.report(at(1.0)).level, Level::kError);
  EXPECT_EQ(monitor_.report(at(2.0)).message, "/odom: bad quaternion");
  monitor_.addGood("/odom", milliseconds(0), at(2.5));
  EXPECT_EQ(monitor_.report(at(3.0)).level, Level::kOk);
}

TEST_F(DriveMonitorTest, WarnsForSomeSecondsOfStampsThatJumpBack) {
  monitor_.addGood("/odom", milliseconds(9000), at(0.0));
  monitor_.addGood("/odom", milliseconds(1000), at(0.1));
  const DriveMonitor::Report report = monitor_.report(at(1.0));
  EXPECT_EQ(report.level, Level::kWarn);
  EXPECT_THAT(report.message, HasSubstr("/odom"));
  EXPECT_THAT(report.message, HasSubstr("jumped back by 8.0 s"));
  monitor_.addGood("/odom", milliseconds(7000), at(6.0));
  EXPECT_EQ(monitor_.report(at(6.0)).level, Level::kOk);
}

TEST_F(DriveMonitorTest, AJumpIsReportedOnceHoweverLateTheReport) {
  monitor_.addGood("/odom", Timestamp::fromNanoseconds(2'000'000'000), at(0.1));
  monitor_.addGood("/odom", Timestamp::fromNanoseconds(1'000'000'000), at(0.2));
  EXPECT_NE(monitor_.report(at(500.0)).message.find("jumped back"), std::string::npos);
  EXPECT_EQ(monitor_.report(at(501.0)).message.find("jumped back"), std::string::npos);
}

TEST_F(DriveMonitorTest, TimeAtWorkIsNobodysSilence) {
  monitor_.expectTopic("/odom");
  monitor_.addGood("/odom", std::nullopt, at(0.1));
  monitor_.beginWork(at(0.2));
  EXPECT_EQ(monitor_.report(at(50.0)).level, Level::kOk) << "at work, so nothing could be taken";
  monitor_.endWork(at(50.0));
  EXPECT_EQ(monitor_.report(at(50.1)).level, Level::kOk);
  EXPECT_NE(monitor_.report(at(60.0)).message.find("/odom: no data for 10.1 s"), std::string::npos);
}

}  // namespace
}  // namespace vcharge
