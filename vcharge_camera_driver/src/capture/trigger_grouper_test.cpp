#include "vcharge_camera_driver/trigger_grouper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace vcharge {
namespace {

constexpr size_t kCameras = 4;
constexpr double kPeriod_s = 0.08;
const Timestamp kStart = Timestamp::fromNanoseconds(1700000000000000000);

Timestamp at(double seconds) {
  return kStart + durationFromSeconds(seconds);
}

Image imageOf(int pulse) {
  Image image;
  image.pixels = cv::Mat(1, 4, CV_8UC1);
  image.pixels.at<int>(0, 0) = pulse;
  return image;
}
int pulseOf(const Image& image) {
  return image.pixels.at<int>(0, 0);
}

struct Arrival {
  Timestamp when;
  CapturedFrame frame;
};

// Faults of a camera.
struct CameraFaults {
  double jitter_periods = 0.0;  // largest error of the stamps
  double loses = 0.0;           // probability that a frame is lost between camera and driver
  double misses = 0.0;          // probability that the camera misses a pulse
  // probability that its frames and stamps start to be late by one pulse, for up to 5 frames
  double delays = 0.0;
  double resets = 0.0;  // probability that its sequence numbers restart
};

std::vector<Arrival> simulate(int num_pulses, const CameraFaults& faults, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Arrival> arrivals;
  for (size_t camera = 0; camera < kCameras; ++camera) {
    uint32_t sequence = 4294967290U + static_cast<uint32_t>(camera);  // wraps soon
    int late_frames = 0;
    Timestamp last_arrival;
    for (int pulse = 0; pulse < num_pulses; ++pulse) {
      const bool is_lost = uniform(random) < faults.loses;
      const bool is_missed = uniform(random) < faults.misses;
      const bool begins_delay = uniform(random) < faults.delays;
      const bool is_reset = uniform(random) < faults.resets;
      const double jitter_s = (2.0 * uniform(random) - 1.0) * faults.jitter_periods * kPeriod_s;
      const double transfer_s = 0.02 + 0.005 * uniform(random);
      const int delay_length = 1 + static_cast<int>(random() % 5);
      late_frames = late_frames > 0 ? late_frames - 1 : begins_delay ? delay_length : 0;
      if (is_missed) {
        continue;
      }
      sequence = is_reset ? 0 : sequence + 1;
      if (is_lost) {
        continue;
      }
      Arrival arrival;
      const double delay_s = late_frames > 0 ? kPeriod_s : 0.0;
      arrival.frame = {camera, sequence, at(pulse * kPeriod_s + jitter_s + delay_s), imageOf(pulse)};
      // Frames of a camera arrive in order.
      arrival.when = std::max(arrival.frame.stamp + durationFromSeconds(transfer_s),
                              last_arrival + durationFromSeconds(1e-6));
      last_arrival = arrival.when;
      arrivals.push_back(arrival);
    }
  }
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.when < b.when; });
  return arrivals;
}

// Feeds the frames like a driver that wakes up at each deadline, and checks all properties of every group.
struct GroupingRun {
  int complete = 0;
  int incomplete = 0;
  int wrong = 0;
  TriggerGrouperCounts counts;

  GroupingRun(const std::vector<Arrival>& arrivals, double max_jitter_periods) {
    TriggerGrouper grouper(kCameras, {1.0 / kPeriod_s, 5});
    std::optional<Timestamp> last;
    std::map<std::pair<size_t, int>, Timestamp> arrived;
    const auto take = [&](const TriggerGrouper::Groups& groups, Timestamp now) {
      for (const auto& group : groups) {
        std::vector<int> pulses;
        Timestamp first = now;
        for (size_t i = 0; i < kCameras; ++i) {
          if (!group->images[i].pixels.empty()) {
            pulses.push_back(pulseOf(group->images[i]));
            first = std::min(first, arrived.at({i, pulses.back()}));
          }
        }
        ASSERT_FALSE(pulses.empty());
        const int pulse = pulses.front();
        const bool one_pulse = std::all_of(pulses.begin(), pulses.end(), [&](int p) { return p == pulse; });
        const double error_s = toSeconds(group->stamp - at(pulse * kPeriod_s));
        wrong += one_pulse && std::abs(error_s) <= max_jitter_periods * kPeriod_s + 1e-9 ? 0 : 1;
        ++(pulses.size() == kCameras ? complete : incomplete);
        ASSERT_TRUE(!last || *last < group->stamp) << "groups come in order";
        last = group->stamp;
        ASSERT_LE(toSeconds(now - first), 0.5 * kPeriod_s + 1e-9);
      }
    };
    for (const Arrival& arrival : arrivals) {
      arrived[{arrival.frame.camera_index, pulseOf(arrival.frame.image)}] = arrival.when;
      while (grouper.nextDeadline() && *grouper.nextDeadline() <= arrival.when) {
        const Timestamp now = *grouper.nextDeadline();
        take(grouper.expire(now), now);
      }
      take(grouper.add(arrival.frame, arrival.when), arrival.when);
    }
    counts = grouper.counts();
  }
};

TEST(TriggerGrouperTest, GroupsEveryPulseOfFaultlessCamerasOnceTheyAgree) {
  const GroupingRun run(simulate(1000, {0.2, 0, 0, 0, 0}, 3), 0.2);
  EXPECT_EQ(run.wrong, 0);
  EXPECT_EQ(run.complete, 995);
  EXPECT_EQ(run.incomplete, 0);
  EXPECT_GT(run.counts.max_spread_s, 0.2 * kPeriod_s);
  EXPECT_LE(run.counts.max_spread_s, 0.4 * kPeriod_s);
}

TEST(TriggerGrouperTest, EveryPublishedGroupIsRightWhateverTheCamerasDo) {
  const std::vector<CameraFaults> all = {
      {0.2, 0.03, 0.0, 0.0, 0.0},         // jitter and lost frames
      {0.2, 0.0, 0.004, 0.0, 0.0},        // pulses missed by a camera
      {0.1, 0.0, 0.0, 0.004, 0.0},        // a camera late by one frame
      {0.1, 0.0, 0.0, 0.0, 0.002},        // restarting sequence numbers
      {0.2, 0.02, 0.001, 0.001, 0.0005},  // all of them
  };
  for (size_t i = 0; i < all.size(); ++i) {
    const GroupingRun run(simulate(10400, all[i], 100 + static_cast<uint32_t>(i)), all[i].jitter_periods);
    EXPECT_EQ(run.wrong, 0) << "case " << i;
    EXPECT_GE(run.complete + run.incomplete, 10000) << "case " << i;
    EXPECT_GE(run.complete, 8000) << "case " << i;
    EXPECT_GT(run.incomplete, 0) << "case " << i;
    uint64_t lost = 0;
    uint64_t slips = 0;
    for (const TriggerCameraCounts& camera : run.counts.cameras) {
      lost += camera.lost;
      slips += camera.slips;
    }
    EXPECT_EQ(lost > 0, all[i].loses > 0.0) << "case " << i;
    EXPECT_EQ(slips > 0, all[i].misses + all[i].delays + all[i].resets > 0.0) << "case " << i;
  }
}

TEST(TriggerGrouperTest, ACameraThatIsGoneDelaysTheOthersByHalfAPeriodAtMost) {
  std::vector<Arrival> arrivals = simulate(200, {0.05, 0, 0, 0, 0}, 5);
  arrivals.erase(std::remove_if(arrivals.begin(), arrivals.end(),
                                [](const Arrival& a) {
                                  return a.frame.camera_index == 2 && pulseOf(a.frame.image) >= 100;
                                }),
                 arrivals.end());
  const GroupingRun run(arrivals, 0.05);  // checks the delay of each group
  EXPECT_EQ(run.wrong, 0);
  EXPECT_EQ(run.complete, 95);
  EXPECT_GE(run.incomplete, 99);  // the last group has not expired yet
  EXPECT_EQ(run.counts.cameras[2].missing, static_cast<uint64_t>(run.incomplete));
  EXPECT_EQ(run.counts.cameras[0].missing, 0u);
}

TEST(TriggerGrouperTest, IsAlignedAgainAfterASlip) {
  std::vector<Arrival> arrivals = simulate(100, {0.0, 0, 0, 0, 0}, 7);
  for (Arrival& arrival : arrivals) {
    if (arrival.frame.camera_index == 1 && pulseOf(arrival.frame.image) >= 50) {
      arrival.frame.sequence -= 7;
    }
  }
  const GroupingRun run(arrivals, 0.0);
  EXPECT_EQ(run.wrong, 0);
  EXPECT_EQ(run.counts.cameras[1].slips, 1u);
  EXPECT_EQ(run.incomplete, 5);
  EXPECT_EQ(run.complete, 90);
}

TEST(TriggerGrouperTest, RejectsBadOptionsByName) {
  EXPECT_THAT(
      [] {
        TriggerGrouper(2, {0.0, 5});
      },
      ::testing::ThrowsMessage<std::invalid_argument>(::testing::StartsWith("frame_rate_hz: ")));
  EXPECT_THAT(
      [] {
        TriggerGrouper(2, {12.5, 0});
      },
      ::testing::ThrowsMessage<std::invalid_argument>(::testing::StartsWith("realign_frames: ")));
}

}  // namespace
}  // namespace vcharge
