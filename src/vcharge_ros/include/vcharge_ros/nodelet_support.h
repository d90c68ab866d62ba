#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/console.h>
#include <ros/node_handle.h>
#include <std_srvs/Trigger.h>

#include "vcharge_ros/drive_monitor.h"

namespace vcharge {

/// Runs callbacks so that nothing they throw reaches ROS: each distinct text is logged once, the last is
/// kept. Thread safe.
class CallbackGuard {
 public:
  /// `name` begins every line in the log.
  explicit CallbackGuard(std::string name) : name_(std::move(name)) {}

  /// True when `function` returned.
  template <class Function>
  bool run(Function&& function) {
    try {
      function();
      return true;
    } catch (const std::exception& error) {
      fail(error.what());
    } catch (...) {
      fail("unknown exception");
    }
    return false;
  }

  uint64_t numFailures() const;
  /// The text of the newest failure; empty when there was none.
  std::string lastError() const;

 private:
  void fail(const std::string& text);

  const std::string name_;
  mutable std::mutex mutex_;
  std::set<std::string> logged_;
  std::string last_error_;
  uint64_t num_failures_ = 0;
};

/// Serves std_srvs/Trigger under `name`. What `serve` throws is the answer's text, without success. The guard
/// must outlive the server. Throws std::runtime_error naming the service if this process serves it already: a
/// nodelet that was unloaded while it worked does so until it is done.
ros::ServiceServer advertiseTrigger(ros::NodeHandle* node, const std::string& name, CallbackGuard* guard,
                                    std::function<void(std_srvs::TriggerResponse*)> serve);

/// Publishes one status on /diagnostics, every second of wall time, also where a simulated clock stands
/// still.
class NodeletDiagnostics {
 public:
  /// `report` is called on the queue of `node`; `name` is the nodelet's and stands in the status's name.
  NodeletDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                     const std::string& name, std::function<DriveMonitor::Report()> report);

 private:
  CallbackGuard guard_;
  std::function<DriveMonitor::Report()> report_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
};

}  // namespace vcharge
