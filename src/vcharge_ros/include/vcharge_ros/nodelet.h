#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nodelet/nodelet.h>
#include <ros/subscriber.h>
#include <boost/shared_ptr.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_ros/live_drive_source.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/parameters.h"

namespace vcharge {

/// Base of all nodelets of the suite.
///
/// The life of a nodelet:
/// 1. The manager loads it and calls start() of the derived class, which reads the parameters, creates
///    the stage,
///    advertises its topics and, last, subscribes. If start() throws, the text is logged and the nodelet is
///    not loaded; the manager goes on.
/// 2. Callbacks convert messages, call the stage and publish its results. What they throw is logged once per
///    text, counted, and shown once on /diagnostics; the nodelet goes on.
/// 3. The destructor of every derived class calls end() first. After end() no callback runs and no service is
///    served, so that the members can be destroyed. A member with a thread of its own (LiveQueue) is declared
///    after all members which that thread uses.
///
/// A nodelet can be unloaded while one of its callbacks runs. nodelet's loader then destroys the callback
/// queues, and the nodelet ends later, in the callback's thread. Its timers and subscriptions would use the
/// destroyed queues until then, so this class keeps the queues alive. The same holds if start() throws.
class Nodelet : public nodelet::Nodelet {
 public:
  ~Nodelet() override;

 protected:
  /// Whether callbacks run one after the other or in several threads of the manager.
  enum class Threads { kOne, kSeveral };
  using Serve = std::function<void(std_srvs::TriggerResponse*)>;
  using Report = std::function<DriveMonitor::Report()>;

  /// `log_name` begins every line in the log.
  explicit Nodelet(const std::string& log_name, Threads threads = Threads::kOne);

  virtual void start() = 0;
  void end();

  ros::NodeHandle& node() const;
  ros::NodeHandle& privateNode() const;
  CallbackGuard& guard() { return guard_; }

  /// Reads a required parameter of the private node handle. InputError names the parameter.
  std::string requireParameter(const std::string& key, const std::string& what) const {
    return requireStringParameter(privateNode(), key, what);
  }
  template <class T>
  T parameter(const std::string& key, const T& default_value) const {
    return privateNode().param(key, default_value);
  }
  template <class Options>
  void readOptions(const std::string& key, Options* options) const {
    readFieldsFromParameters(privateNode(), key, options);
  }
  /// Reads the rig whose path is the parameter ~rig.
  std::shared_ptr<const CameraRig> readRig() const;
  /// ~lossless_replay: every message is processed in order; otherwise, old ones are dropped and counted.
  bool isLossless() const { return parameter("lossless_replay", false); }
  /// ~processor_budget: processor seconds per second that a stage may use, 0 without a limit; none in a
  /// replay without loss. InputError if it is negative.
  double processorBudget() const;

  /// Makes the source of a drive, with the options ~source. It is subscribed by runSource().
  void openSource(std::shared_ptr<const CameraRig> rig, const std::vector<std::string>& cameras = {});
  /// Starts to feed the consumer and adds the topics' state to the diagnostics. The last step of start().
  void runSource(DriveConsumer* consumer);
  /// Delivers the messages that are waiting in the source's sort window.
  void flushSource() { source_->flush(); }

  template <class Message>
  ros::Publisher advertiseLatched(const std::string& topic) const {
    return node().template advertise<Message>(topic, 1, true);
  }
  /// Subscribes to a topic; `callback` runs until end().
  template <class Message>
  void subscribe(const std::string& topic, uint32_t queue_size,
                 std::function<void(const boost::shared_ptr<const Message>&)> callback) {
    subscribers_.push_back(subscribePromptly<Message>(
        &node(), topic, queue_size, [this, callback](const boost::shared_ptr<const Message>& message) {
          guard_.run([&] { callback(message); });
        }));
  }
  /// Adds a status named after the nodelet and `suffix` ("/pose") to /diagnostics. With Threads::kOne, report
  /// is called between two callbacks; with kSeveral, at any time.
  void addDiagnostics(const std::string& suffix, Report report, Threads threads);
  /// Serves std_srvs/Trigger under ~`name`; see advertiseTrigger().
  void serve(const std::string& name, Serve work);

 private:
  void onInit() final;
  void addStatus(const std::string& suffix, Report report, Threads threads);

  const Threads threads_;
  CallbackGuard guard_;
  // Members of derived classes are destroyed before these.
  boost::shared_ptr<const void> single_threaded_queue_, multi_threaded_queue_;
  std::unique_ptr<LiveDriveSource> source_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> servers_;
  std::vector<std::unique_ptr<NodeletDiagnostics>> diagnostics_;
};

}  // namespace vcharge
