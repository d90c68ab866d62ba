#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <string>
#include <utility>

#include <ros/node_handle.h>
#include <boost/shared_ptr.hpp>

namespace vcharge::internal {

/// Publishes on a topic unless somebody else says the same there. It listens to its own topic; roscpp hands a
/// message that was published by pointer to subscribers of the same process as that very pointer, which tells
/// own messages from others' also where those come from another nodelet of the same manager.
template <class Message>
class SharedTopic {
 public:
  using Clock = std::chrono::steady_clock;
  using MessageConstPtr = boost::shared_ptr<const Message>;

  /// `conflicts` says whether a foreign message makes ours superfluous; the topic is taken back once none
  /// came for `patience`.
  SharedTopic(ros::NodeHandle* node, const std::string& topic, uint32_t queue_size, Clock::duration patience,
              std::function<bool(const Message&)> conflicts)
      : patience_(patience), conflicts_(std::move(conflicts)) {
    publisher_ = node->advertise<Message>(topic, queue_size);
    subscriber_ = node->subscribe<Message>(topic, queue_size,
                                           boost::function<void(const MessageConstPtr&)>(
                                               [this](const MessageConstPtr& message) { listen(message); }));
  }

  /// True while somebody else publishes.
  bool standsAside() const { return seen_foreign_ && Clock::now() - last_foreign_ < patience_; }

  /// Publishes unless it stands aside. The message must not be changed afterwards.
  void publish(const MessageConstPtr& message) {
    if (standsAside()) {
      return;
    }
    own_.push_back(message);
    if (own_.size() > kMaxRemembered) {
      own_.pop_front();
    }
    publisher_.publish(message);
  }

 private:
  static constexpr size_t kMaxRemembered = 1000;  // far more than a queue that is served holds

  void listen(const MessageConstPtr& message) {
    for (auto own = own_.begin(); own != own_.end(); ++own) {
      if (*own == message) {
        own_.erase(own_.begin(), std::next(own));  // they come back in order
        return;
      }
    }
    if (conflicts_(*message)) {
      seen_foreign_ = true;
      last_foreign_ = Clock::now();
    }
  }

  const Clock::duration patience_;
  const std::function<bool(const Message&)> conflicts_;
  std::deque<MessageConstPtr> own_;  // published and not heard again yet
  bool seen_foreign_ = false;
  Clock::time_point last_foreign_;
  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
};

}  // namespace vcharge::internal
