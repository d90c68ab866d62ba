#include "vcharge_ros/nodelet.h"

#include <nodelet/detail/callback_queue.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/memory_reuse.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {
namespace {

/// Keeps a queue of nodelet's loader alive; null for a queue of another kind, which its owner keeps alive.
boost::shared_ptr<const void> keep(ros::CallbackQueueInterface* queue) {
  auto* const shared = dynamic_cast<nodelet::detail::CallbackQueue*>(queue);
  return shared ? shared->shared_from_this() : boost::shared_ptr<const void>();
}

}  // namespace

Nodelet::Nodelet(const std::string& log_name, Threads threads) : threads_(threads), guard_(log_name) {}

Nodelet::~Nodelet() {
  end();
}

void Nodelet::onInit() {
  keepFreedMemory();
  single_threaded_queue_ = keep(&getSTCallbackQueue());
  multi_threaded_queue_ = keep(&getMTCallbackQueue());
  try {
    start();
  } catch (const std::exception& error) {
    NODELET_FATAL_STREAM(error.what());  // the manager only logs that the nodelet was not loaded
    end();
    throw;
  }
}

void Nodelet::end() {
  diagnostics_.clear();
  servers_.clear();
  subscribers_.clear();
  source_.reset();
}

ros::NodeHandle& Nodelet::node() const {
  return threads_ == Threads::kOne ? getNodeHandle() : getMTNodeHandle();
}

ros::NodeHandle& Nodelet::privateNode() const {
  return threads_ == Threads::kOne ? getPrivateNodeHandle() : getMTPrivateNodeHandle();
}

double Nodelet::processorBudget() const {
  const double budget = parameter("processor_budget", 0.0);
  if (!(budget >= 0.0)) {
    throw InputError(privateNode().resolveName("processor_budget") + ": expected at least 0, got " +
                     toText(budget, 2));
  }
  return isLossless() ? 0.0 : budget;
}

std::shared_ptr<const CameraRig> Nodelet::readRig() const {
  return std::make_shared<const CameraRig>(readCameraRig(requireParameter("rig", "the path of a rig.yaml")));
}

void Nodelet::openSource(std::shared_ptr<const CameraRig> rig, const std::vector<std::string>& cameras) {
  LiveDriveSourceOptions options;
  options.cameras = cameras;
  if (isLossless()) {
    options.takeEverything();
  }
  readOptions("source", &options);
  source_ = std::make_unique<LiveDriveSource>(node(), std::move(rig), options);
}

void Nodelet::runSource(DriveConsumer* consumer) {
  addStatus(
      "", [this] { return source_->report(); }, Threads::kSeveral);
  source_->run(consumer, DriveSource::ProgressCallback());
}

void Nodelet::addDiagnostics(const std::string& suffix, Report report, Threads threads) {
  addStatus(
      suffix,
      [this, report = std::move(report), num_shown = uint64_t{0}]() mutable {
        DriveMonitor::Report state = report();
        if (const uint64_t num_failures = guard_.numFailures(); num_failures > num_shown) {
          num_shown = num_failures;
          state.level = DriveMonitor::Level::kError;
          state.message = guard_.lastError();
        }
        return state;
      },
      threads);
}

void Nodelet::addStatus(const std::string& suffix, Report report, Threads threads) {
  const bool is_serialized = threads == Threads::kOne;
  diagnostics_.push_back(std::make_unique<NodeletDiagnostics>(
      is_serialized ? node() : getMTNodeHandle(), is_serialized ? privateNode() : getMTPrivateNodeHandle(),
      getName() + suffix, std::move(report)));
}

void Nodelet::serve(const std::string& name, Serve work) {
  servers_.push_back(advertiseTrigger(&privateNode(), name, &guard_, std::move(work)));
}

}  // namespace vcharge
