#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/transport_hints.h>
#include <boost/shared_ptr.hpp>

namespace vcharge {

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
