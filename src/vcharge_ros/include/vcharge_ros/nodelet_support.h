#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/console.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/transport_hints.h>
#include <std_srvs/Trigger.h>
#include <boost/shared_ptr.hpp>

#include "vcharge_core/frames/frame_assembler_options.h"
#include "vcharge_ros/drive_monitor.h"

namespace vcharge {

/// Runs callbacks so that no exception reaches ROS: each distinct error is logged once, the last one is kept.
/// Thread safe.
class CallbackGuard {
 public:
  /// `name` begins every line in the log.
  explicit CallbackGuard(std::string name) : name_(std::move(name)) {}

  /// Calls `function`; returns false if it threw an exception.
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

/// Serves std_srvs/Trigger under `name`. If `serve` throws, the answer has success = false and the error's
/// text. The guard must outlive the server. Throws std::runtime_error naming the service if this process
/// already serves it, for example in an unloaded nodelet whose last callback is still running.
ros::ServiceServer advertiseTrigger(ros::NodeHandle* node, const std::string& name, CallbackGuard* guard,
                                    std::function<void(std_srvs::TriggerResponse*)> serve);

/// Adds the counters of all frames of the drive to a status, as "all_<name>".
void addCounters(const FrameCounters& counters, DriveMonitor::Report* report);

/// Publishes one status on /diagnostics, every second of wall time, also while a simulated clock is stopped.
class NodeletDiagnostics {
 public:
  /// `report` is called on the queue of `node`; `name` is that of the status.
  NodeletDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                     const std::string& name, std::function<DriveMonitor::Report()> report);

 private:
  CallbackGuard guard_;
  std::function<DriveMonitor::Report()> report_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
};

/// Subscribes without Nagle's algorithm, which holds back the end of a message for up to 40 ms. The
/// subscribers of a process share the connection that the first of them asked for, so that all have to ask
/// for it.
template <class Message>
ros::Subscriber subscribePromptly(ros::NodeHandle* node, const std::string& topic, uint32_t queue_size,
                                  std::function<void(const boost::shared_ptr<const Message>&)> callback) {
  return node->subscribe<Message>(topic, queue_size, std::move(callback), ros::VoidConstPtr(),
                                  ros::TransportHints().tcpNoDelay());
}

}  // namespace vcharge
