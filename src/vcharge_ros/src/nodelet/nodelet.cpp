#include "vcharge_ros/nodelet.h"

#include <nodelet/detail/callback_queue.h>

namespace vcharge {
namespace {

/// A share in a queue of nodelet's loader; nothing of another queue, whose owner has to keep it.
boost::shared_ptr<const void> keep(ros::CallbackQueueInterface* queue) {
  auto* const shared = dynamic_cast<nodelet::detail::CallbackQueue*>(queue);
  return shared ? shared->shared_from_this() : boost::shared_ptr<const void>();
}

}  // namespace

void Nodelet::onInit() {
  single_threaded_queue_ = keep(&getSTCallbackQueue());
  multi_threaded_queue_ = keep(&getMTCallbackQueue());
  initialize();
}

}  // namespace vcharge
