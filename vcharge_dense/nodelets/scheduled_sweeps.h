#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <ros/node_handle.h>
#include <vcharge_msgs/ScheduledCameras.h>

#include "range_map_publisher.h"
#include "vcharge_dense/range_mapper.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/live_queue.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/stage_schedule.h"

namespace vcharge {

/// Sweeps the tasks of a RangeMapper in threads of its own, those of the newest stamp first, for the cameras
/// that a schedule chooses, and publishes the range maps. Before those of a stamp, /dense/scheduled announces
/// their cameras. In a replay without loss, all tasks are swept at once in the caller's thread.
class ScheduledSweeps {
 public:
  /// The mapper, the schedule and the guard must outlive this object.
  ScheduledSweeps(ros::NodeHandle* node, std::shared_ptr<const CameraRig> rig, const RangeMapper* mapper,
                  StageSchedule* schedule, CallbackGuard* guard, bool is_lossless)
      : rig_(std::move(rig)), mapper_(mapper), schedule_(schedule) {
    const uint32_t queue_size = is_lossless ? 0 : kQueueSize;
    scheduled_ = node->advertise<vcharge_msgs::ScheduledCameras>("/dense/scheduled", queue_size);
    for (const RangeMapperStatus& camera : mapper->status()) {
      const size_t index = rig_->cameraIndex(camera.camera_name);
      publishers_.try_emplace(index, node, rig_->cameras[index], queue_size);
    }
    queue_ = std::make_unique<LiveQueue<Instant>>(
        is_lossless, [this, guard](const Instant& instant) { guard->run([&] { sweep(instant); }); });
  }

  /// Queues tasks in the order of their stamps, and empties the list.
  void push(std::vector<RangeTask>* tasks) {
    for (auto first = tasks->begin(); first != tasks->end();) {
      const Timestamp stamp = first->reference.stamp;
      const auto last = std::find_if(first, tasks->end(),
                                     [&](const RangeTask& task) { return task.reference.stamp != stamp; });
      queue_->push(0, Instant(std::make_move_iterator(first), std::make_move_iterator(last)));
      first = last;
    }
    tasks->clear();
  }
  /// Stamps whose tasks were replaced by newer ones.
  uint64_t numDropped() const { return queue_->numDropped(0); }

 private:
  static constexpr uint32_t kQueueSize = 10;  // 0 would mean that nothing is ever dropped
  using Instant = std::vector<RangeTask>;     // tasks of one stamp

  void sweep(const Instant& instant) {
    const Timestamp stamp = instant.front().reference.stamp;
    std::vector<bool> candidates(rig_->cameras.size(), false);
    for (const RangeTask& task : instant) {
      candidates[task.camera_index] = true;
    }
    const std::vector<size_t> chosen = schedule_->choose(stamp, candidates);
    vcharge_msgs::ScheduledCameras announcement;
    announcement.header.stamp = fromTimestamp(stamp);
    for (const size_t camera : chosen) {
      announcement.cameras.push_back(rig_->cameras[camera].name);
    }
    scheduled_.publish(announcement);
    schedule_->letResultsGoFirst();
    schedule_->runTurns(chosen, [&](size_t camera) {
      const auto task = std::find_if(instant.begin(), instant.end(),
                                     [camera](const RangeTask& each) { return each.camera_index == camera; });
      publishers_.at(camera).publish(mapper_->sweep(*task));
    });
  }

  const std::shared_ptr<const CameraRig> rig_;
  const RangeMapper* const mapper_;
  StageSchedule* const schedule_;
  ros::Publisher scheduled_;
  std::map<size_t, RangeMapPublisher> publishers_;  // key: index of the camera
  std::unique_ptr<LiveQueue<Instant>> queue_;
};

}  // namespace vcharge
