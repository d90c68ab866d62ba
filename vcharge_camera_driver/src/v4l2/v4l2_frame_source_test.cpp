#include "vcharge_camera_driver/v4l2_frame_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <ctime>
#include <functional>
#include <map>
#include <thread>

#include "capture/emulated_cameras.h"
#include "vcharge_camera_driver/image_pool.h"
#include "vcharge_camera_driver/trigger_grouper.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;

constexpr auto kPatience = std::chrono::seconds(30);

V4l2FrameSourceOptions smallImages() {
  V4l2FrameSourceOptions options;
  options.capture.image_size_px = {320, 240};
  options.capture.frame_rate_hz = 50.0;
  options.timeout_s = 0.3;
  options.reconnect_s = 0.05;
  return options;
}
const char* const kSmall = "width=320\nheight=240\nrate_hz=50\nexposure_us=1000\nreadout_us=2000\n";

// Groups frames and records the numbers of the groups.
class GroupingSink : public FrameSink {
 public:
  GroupingSink(size_t num_cameras, double frame_rate_hz) : grouper_(num_cameras, {frame_rate_hz, 3}) {}

  Image acquire(cv::Size size_px) override {
    const std::shared_ptr<cv::Mat> buffer = pool_.acquire();
    buffer->create(size_px, CV_8UC1);
    buffers_[buffer.get()] += 1;
    Image image;
    image.pixels = *buffer;
    image.owner = buffer;
    return image;
  }
  void add(const CapturedFrame& frame) override { take(grouper_.add(frame, monotonicNow())); }
  Duration idle() override {
    take(grouper_.expire(monotonicNow()));
    const auto deadline = grouper_.nextDeadline();
    return deadline ? *deadline - monotonicNow() : Duration(std::chrono::seconds(1));
  }

  void waitFor(const std::function<bool()>& condition, const char* what) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, condition)) {
      ADD_FAILURE() << "timed out waiting for " << what;
    }
  }
  // Protected by mutex_ during the run; read without lock after its end.
  int complete = 0;
  int incomplete = 0;
  int wrong = 0;
  std::vector<bool> last_present;
  size_t numBuffers() const { return buffers_.size(); }
  TriggerGrouperCounts counts() const { return grouper_.counts(); }

 private:
  void take(const TriggerGrouper::Groups& groups) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& group : groups) {
      last_present.clear();
      std::optional<uint64_t> pulse;
      for (const Image& image : group->images) {
        last_present.push_back(!image.pixels.empty());
        if (last_present.back()) {
          wrong += pulse && *pulse != pulseIn(image.pixels) ? 1 : 0;
          pulse = pulseIn(image.pixels);
        }
      }
      const bool all = std::count(last_present.begin(), last_present.end(), true) ==
                       static_cast<std::ptrdiff_t>(last_present.size());
      ++(all ? complete : incomplete);
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  TriggerGrouper grouper_;
  BufferPool<cv::Mat> pool_;
  std::map<const cv::Mat*, int> buffers_;
};

// Records the stamps of each camera's frames, over those of their pulses.
class StampSink : public FrameSink {
 public:
  StampSink(size_t num_cameras, double period_s) : delays_s(num_cameras), period_s_(period_s) {}

  Image acquire(cv::Size size_px) override { return {cv::Mat(size_px, CV_8UC1), nullptr}; }
  void add(const CapturedFrame& frame) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    delays_s[frame.camera_index].push_back(toSeconds(frame.stamp - Timestamp()) -
                                           period_s_ * static_cast<double>(pulseIn(frame.image.pixels)));
  }
  Duration idle() override { return std::chrono::seconds(1); }

  bool hasFrames(size_t num) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::all_of(delays_s.begin(), delays_s.end(),
                       [&](const auto& each) { return each.size() >= num; });
  }
  std::vector<std::vector<double>> delays_s;  // read without lock after the end of the run

 private:
  const double period_s_;
  std::mutex mutex_;
};

// Runs a source in a thread.
class Running {
 public:
  Running(FrameSource* source, FrameSink* sink) : source_(source), thread_([=] { source->run(sink); }) {}
  ~Running() {
    source_->stop();
    thread_.join();
  }

 private:
  FrameSource* source_;
  std::thread thread_;
};

double cpuSeconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

class V4l2FrameSourceTest : public ::testing::Test {
 protected:
  EmulatedCameras cameras_;
};

TEST_F(V4l2FrameSourceTest, FourCamerasGiveWholeGroupsAndStopAtOnce) {
  std::vector<std::string> paths;
  for (int i = 0; i < 4; ++i) {
    paths.push_back(cameras_.plug(i, std::string(kSmall) + "jitter_us=2000\n"));
  }
  GroupingSink sink(4, 50.0);
  V4l2FrameSource source(paths, smallImages(), systemNow);
  {
    const Running running(&source, &sink);
    sink.waitFor([&] { return sink.complete >= 30; }, "groups");
  }
  EXPECT_EQ(sink.wrong, 0);
  for (const CameraStatus& status : source.status()) {
    EXPECT_FALSE(status.streaming);
    EXPECT_EQ(status.connections, 1u);
    EXPECT_GE(status.frames, 30u);
  }
  EXPECT_LE(sink.numBuffers(), 16u) << "buffers are used again";
}

TEST_F(V4l2FrameSourceTest, StampsAreOfTheDrivesClock) {
  const std::string path = cameras_.plug(0, kSmall);
  struct Sink : GroupingSink {
    using GroupingSink::GroupingSink;
    void add(const CapturedFrame& frame) override {
      error_s = std::max(error_s, toSeconds(systemNow() - frame.stamp));
      early_s = std::max(early_s, toSeconds(frame.stamp - systemNow()));
      GroupingSink::add(frame);
    }
    double error_s = 0.0, early_s = 0.0;
  } sink(1, 50.0);
  V4l2FrameSource source({path}, smallImages(), systemNow);
  {
    const Running running(&source, &sink);
    sink.waitFor([&] { return sink.complete >= 10; }, "groups");
  }
  EXPECT_LT(sink.early_s, 0.0005);
  EXPECT_LT(sink.error_s, 10.0);
}

TEST_F(V4l2FrameSourceTest, ACameraIsUnpluggedAndPluggedInAgainWhileTheOtherGoesOn) {
  const std::vector<std::string> paths = {cameras_.plug(0, kSmall), cameras_.plug(1, kSmall)};
  GroupingSink sink(2, 50.0);
  V4l2FrameSource source(paths, smallImages(), systemNow);
  {
    const Running running(&source, &sink);
    sink.waitFor([&] { return sink.complete >= 5; }, "groups of both");
    cameras_.unplug(1);
    sink.waitFor([&] { return sink.incomplete >= 10 && sink.last_present[0] && !sink.last_present[1]; },
                 "groups of the first");
    CameraStatus status = source.status()[1];
    EXPECT_FALSE(status.streaming);
    EXPECT_THAT(status.message, HasSubstr(paths[1]));
    EXPECT_TRUE(source.status()[0].streaming);
    cameras_.plug(1, kSmall);
    const int before = sink.complete;
    sink.waitFor([&] { return sink.complete >= before + 5; }, "groups of both again");
  }
  EXPECT_EQ(sink.wrong, 0);
  EXPECT_EQ(source.status()[1].connections, 2u);
  EXPECT_EQ(source.status()[0].connections, 1u);
}

TEST_F(V4l2FrameSourceTest, ASilentCameraTimesOutAndIsOpenedAnew) {
  const std::string path = cameras_.plug(0, std::string(kSmall) + "silent_after=10\n");
  GroupingSink sink(1, 50.0);
  V4l2FrameSource source({path}, smallImages(), systemNow);
  {
    const Running running(&source, &sink);
    sink.waitFor([&] { return sink.complete >= 10; }, "groups after a time-out");
  }
  EXPECT_GE(source.status()[0].timeouts, 1u);
  EXPECT_GE(source.status()[0].connections, 2u);
}

TEST_F(V4l2FrameSourceTest, DamagedAndShortFramesAreSkippedAndCounted) {
  const std::string path = cameras_.plug(0, std::string(kSmall) + "damage_every=5\nshort_every=7\n");
  GroupingSink sink(1, 50.0);
  V4l2FrameSource source({path}, smallImages(), systemNow);
  {
    const Running running(&source, &sink);
    sink.waitFor([&] { return sink.complete >= 40; }, "groups");
  }
  const CameraStatus status = source.status()[0];
  EXPECT_GE(status.damaged, 10u);
  EXPECT_NEAR(static_cast<double>(status.damaged),
              static_cast<double>(status.frames + status.damaged) * 11 / 35, 8);
  EXPECT_EQ(sink.wrong, 0);
}

TEST_F(V4l2FrameSourceTest, LosesNoFrameOfFourLargeCamerasAndHardlyWorks) {
  const char* seconds_text = std::getenv("VCHARGE_CAPTURE_SECONDS");
  const double seconds = seconds_text != nullptr ? std::atof(seconds_text) : 3.0;
  std::vector<std::string> paths;
  for (int i = 0; i < 4; ++i) {
    paths.push_back(cameras_.plug(i, "width=1280\nheight=800\nrate_hz=12.5\njitter_us=500\n"));
  }
  GroupingSink sink(4, 12.5);
  V4l2FrameSource source(paths, V4l2FrameSourceOptions(), systemNow);
  const double wall_before = cpuSeconds(CLOCK_MONOTONIC);
  const double cpu_before = cpuSeconds(CLOCK_PROCESS_CPUTIME_ID) - vchargeEmulatorCpuSeconds();
  {
    const Running running(&source, &sink);
    const int num_groups = static_cast<int>(seconds * 12.5);
    for (int groups = 1; groups <= num_groups; ++groups) {
      sink.waitFor([&] { return sink.complete >= groups; }, "a group");
    }
  }
  const double wall_s = cpuSeconds(CLOCK_MONOTONIC) - wall_before;
  const double cpu_s = cpuSeconds(CLOCK_PROCESS_CPUTIME_ID) - vchargeEmulatorCpuSeconds() - cpu_before;
  std::cout << sink.complete << " groups in " << wall_s << " s, " << 100.0 * cpu_s / wall_s
            << " % of a core, mean spread " << 1e3 * sink.counts().mean_spread_s << " ms\n";
  EXPECT_EQ(sink.wrong, 0);
  for (const CameraStatus& status : source.status()) {
    EXPECT_EQ(status.lost, 0u);
    EXPECT_EQ(status.damaged, 0u);
  }
  for (const TriggerCameraCounts& camera : sink.counts().cameras) {
    EXPECT_EQ(camera.lost, 0u);
    EXPECT_EQ(camera.slips, 0u);
  }
}

TEST_F(V4l2FrameSourceTest, StampsAreThoseOfTheMiddleOfTheExposure) {
  std::vector<std::string> devices{cameras_.plug(0, kSmall),
                                   cameras_.plug(1, std::string(kSmall) + "stamps_start=1\n")};
  V4l2FrameSourceOptions options = smallImages();
  options.capture.controls = {"exposure_time_absolute=40"};  // 4 ms
  options.readouts_s = {0.006, 0.002};
  V4l2FrameSource source(devices, options, monotonicNow);
  StampSink sink(2, 0.02);
  {
    const Running running(&source, &sink);
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!sink.hasFrames(5) && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_NEAR(source.status().at(0).exposure_s.value_or(0.0), 0.004, 1e-9);
  }
  ASSERT_TRUE(sink.hasFrames(5));
  // The emulated stamps are 1 ms after the pulse.
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(sink.delays_s[0][i], 0.001 - 0.5 * (0.004 + 0.006), 2e-4);
    EXPECT_NEAR(sink.delays_s[1][i], 0.001 + 0.5 * (0.004 + 0.002), 2e-4);
  }
}

}  // namespace
}  // namespace vcharge
