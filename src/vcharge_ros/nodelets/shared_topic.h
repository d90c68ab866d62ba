#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <string>
#include <utility>

#include <ros/node_handle.h>
#include <boost/shared_ptr.hpp>

#include "vcharge_ros/nodelet_support.h"

namespace vcharge::internal {

/// Publishes on a topic unless another node publishes the same there. It subscribes to its own topic: roscpp
/// passes a message that was published by pointer to subscribers of the same process as that pointer, which
/// distinguishes own messages from those of other nodelets of the same manager.
template <class Message>
class SharedTopic {
 public:
  using Clock = std::chrono::steady_clock;
  using MessageConstPtr = boost::shared_ptr<const Message>;

  /// `conflicts`: whether a message of another node makes publishing unnecessary. Publishing resumes when no
  /// such message has arrived for kPatience.
  SharedTopic(ros::NodeHandle* node, const std::string& topic, uint32_t queue_size,
              std::function<bool(const Message&)> conflicts)
      : conflicts_(std::move(conflicts)) {
    publisher_ = node->advertise<Message>(topic, queue_size);
    subscriber_ = subscribePromptly<Message>(node, topic, queue_size,
                                             [this](const MessageConstPtr& message) { listen(message); });
  }

  /// True while another node publishes.
  bool anotherPublishes() const { return seen_foreign_ && Clock::now() - last_foreign_ < kPatience; }

  /// Publishes unless another node does. The message must not be changed afterwards.
  void publish(const MessageConstPtr& message) {
    if (anotherPublishes()) {
      return;
    }
    own_.push_back(message);
    if (own_.size() > kMaxRemembered) {
      own_.pop_front();
    }
    publisher_.publish(message);
  }

 private:
  static constexpr Clock::duration kPatience = std::chrono::seconds(2);
  static constexpr size_t kMaxRemembered = 1000;  // far more than a queue holds

  void listen(const MessageConstPtr& message) {
    for (auto own = own_.begin(); own != own_.end(); ++own) {
      if (*own == message) {
        own_.erase(own_.begin(), std::next(own));  // messages are received in order
        return;
      }
    }
    if (conflicts_(*message)) {
      seen_foreign_ = true;
      last_foreign_ = Clock::now();
    }
  }

  const std::function<bool(const Message&)> conflicts_;
  std::deque<MessageConstPtr> own_;  // published but not yet received back
  bool seen_foreign_ = false;
  Clock::time_point last_foreign_;
  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
};

}  // namespace vcharge::internal
