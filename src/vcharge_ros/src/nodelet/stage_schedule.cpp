#include "vcharge_ros/stage_schedule.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <string>

#include <tbb/task_arena.h>
#include <opencv2/core/utility.hpp>

#include "vcharge_core/base/text_format.h"

namespace vcharge {

StageSchedule::StageSchedule(const CameraRig& rig, double budget_s_per_s, size_t num_threads)
    : schedule_(rig, budget_s_per_s, num_threads) {
  if (hasLimit()) {
    cv::setNumThreads(1);  // of the whole process: all stages share the processors
  }
}

void StageSchedule::setOdometry(const VehicleOdometry& odometry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  odometry_ = odometry;
}

void StageSchedule::setObjects(const vcharge_msgs::TrackedObjects& objects) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!odometry_) {
    return;
  }
  const RigidTransform vehicle_from_odom = odometry_->odom_from_vehicle.inverse();
  std::vector<Eigen::Vector2d> in_vehicle_m;
  for (const vcharge_msgs::TrackedObject& object : objects.objects) {
    const auto& position = object.pose.position;
    in_vehicle_m.emplace_back(
        (vehicle_from_odom * Eigen::Vector3d(position.x, position.y, position.z)).head<2>());
  }
  schedule_.setObjects(in_vehicle_m);
}

void StageSchedule::letResultsGoFirst() const {
  if (hasLimit()) {
    letOthersGoFirst();
  }
}

std::vector<size_t> StageSchedule::choose(Timestamp stamp, const std::vector<bool>& candidates) {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (odometry_) {
      velocity << odometry_->forward_speed_m_per_s, 0.0, odometry_->yaw_rate_rad_per_s;
    }
  }
  return schedule_.choose(stamp, candidates, velocity);
}

void StageSchedule::runAndCount(const std::function<size_t()>& work) {
  if (!hasLimit()) {
    work();
    return;
  }
  tbb::task_arena one_thread(1);
  const double begin_s = threadProcessorTime_s();
  const auto begin = std::chrono::steady_clock::now();
  const size_t num_turns = one_thread.execute(work);
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
  schedule_.spend(threadProcessorTime_s() - begin_s, passed.count(), num_turns);
}

void StageSchedule::runTurns(const std::vector<size_t>& cameras,
                             const std::function<void(size_t camera)>& work) {
  std::atomic<size_t> next = 0;
  const auto takeTurns = [&] {
    for (size_t i = next++; i < cameras.size(); i = next++) {
      runAndCount([&]() -> size_t {
        work(cameras[i]);
        return 1;
      });
    }
  };
  // Not in workers of TBB: other stages' loops occupy them.
  std::vector<std::future<void>> others;
  const size_t num_threads = std::min(schedule_.numThreads(), cameras.size());
  for (size_t thread = 1; thread < num_threads; ++thread) {
    others.push_back(std::async(std::launch::async, takeTurns));
  }
  takeTurns();
  for (std::future<void>& other : others) {
    other.get();
  }
}

void StageSchedule::describe(size_t camera, DriveMonitor::Report* report) const {
  const CameraSchedule::Status status = schedule_.status();
  if (hasLimit()) {
    report->values.emplace_back("left_out", std::to_string(status.left_out[camera]));
    describe(status, report);
  }
}

void StageSchedule::describe(const CameraRig& rig, DriveMonitor::Report* report) const {
  const CameraSchedule::Status status = schedule_.status();
  if (hasLimit()) {
    for (size_t i = 0; i < rig.cameras.size(); ++i) {
      report->values.emplace_back(rig.cameras[i].name + "_left_out", std::to_string(status.left_out[i]));
    }
    describe(status, report);
  }
}

void StageSchedule::describe(const CameraSchedule::Status& status, DriveMonitor::Report* report) const {
  report->values.emplace_back("processor_budget", toText(status.budget_s_per_s, 2));
  report->values.emplace_back("processor_used", toText(status.used_s_per_s, 2));
  if (status.is_short && report->level == DriveMonitor::Level::kOk) {
    report->level = DriveMonitor::Level::kWarn;
    report->message += "; the processor budget does not suffice for every image";
  }
}

}  // namespace vcharge
