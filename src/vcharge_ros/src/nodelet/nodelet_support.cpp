#include "vcharge_ros/nodelet_support.h"

#include <stdexcept>

namespace vcharge {
namespace {

constexpr double kDiagnosticsPeriod_s = 1.0;
constexpr size_t kMaxLoggedTexts = 100;  // texts may contain stamps: the log must not grow without bound

}  // namespace

uint64_t CallbackGuard::numFailures() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return num_failures_;
}

std::string CallbackGuard::lastError() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_error_;
}

void CallbackGuard::fail(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++num_failures_;
  last_error_ = text;
  if (logged_.size() < kMaxLoggedTexts && logged_.insert(text).second) {
    ROS_ERROR_STREAM(name_ << ": " << text);
  }
}

ros::ServiceServer advertiseTrigger(ros::NodeHandle* node, const std::string& name, CallbackGuard* guard,
                                    std::function<void(std_srvs::TriggerResponse*)> serve) {
  const boost::function<bool(std_srvs::TriggerRequest&, std_srvs::TriggerResponse&)> call =
      [guard, serve = std::move(serve)](std_srvs::TriggerRequest& /*request*/,
                                        std_srvs::TriggerResponse& response) {
        if (!guard->run([&] { serve(&response); })) {
          response.success = 0;
          response.message = guard->lastError();
        }
        return true;
      };
  ros::ServiceServer server = node->advertiseService(name, call);
  if (!server) {
    throw std::runtime_error(node->resolveName(name) +
                             ": is served already: does a nodelet of this name still end its work?");
  }
  return server;
}

void addCounters(const FrameCounters& counters, DriveMonitor::Report* report) {
  for (const auto& [name, count] : counters.named()) {
    report->values.emplace_back("all_" + name, std::to_string(count));
  }
}

NodeletDiagnostics::NodeletDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                                       const std::string& name, std::function<DriveMonitor::Report()> report)
    : guard_(name), report_(std::move(report)), updater_(node, private_node, name) {
  updater_.setHardwareID("none");
  updater_.add("drive", [this](diagnostic_updater::DiagnosticStatusWrapper& status) {
    const bool reported = guard_.run([&] {
      const DriveMonitor::Report state = report_();
      status.summary(static_cast<unsigned char>(state.level), state.message);
      for (const auto& [key, value] : state.values) {
        status.add(key, value);
      }
    });
    if (!reported) {
      status.summary(diagnostic_msgs::DiagnosticStatus::ERROR, guard_.lastError());
    }
  });
  timer_ = node.createWallTimer(ros::WallDuration(kDiagnosticsPeriod_s),
                                [this](const ros::WallTimerEvent&) { updater_.force_update(); });
}

}  // namespace vcharge
