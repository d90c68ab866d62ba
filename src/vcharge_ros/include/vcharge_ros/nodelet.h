#pragma once

#include <nodelet/nodelet.h>
#include <boost/shared_ptr.hpp>

namespace vcharge {

/// A nodelet that can be unloaded, and can fail to load, at any time. Base of all nodelets of the suite.
///
/// nodelet's loader destroys the callback queues of a nodelet that it lets go of, but not the nodelet, where
/// one of its callbacks is running: that ends the nodelet later, in the callback's thread. The timers and
/// subscriptions that it still has would use the queues until then, and the manager would crash. The same
/// happens to a nodelet whose initialization throws. So the nodelet itself keeps its queues.
class Nodelet : public nodelet::Nodelet {
 protected:
  /// Instead of onInit(): whatever it throws, the nodelet is not loaded, and the manager goes on.
  virtual void initialize() = 0;

 private:
  void onInit() final;

  // Members of derived classes are destroyed before these.
  boost::shared_ptr<const void> single_threaded_queue_, multi_threaded_queue_;
};

}  // namespace vcharge
