#include "vcharge_ros/live_drive_source.h"

#include <cmath>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <set>

#include <ros/console.h>
#include <ros/subscriber.h>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/drive_item.h"
#include "vcharge_ros/image_conversions.h"
#include "vcharge_ros/nodelet_support.h"
#include "vcharge_ros/stamp_sorter.h"

namespace vcharge {
namespace {

using internal::DriveItem;
using SteadyClock = std::chrono::steady_clock;

constexpr char kProcessing[] = "processing";  // the consumer's entry among the monitor's topics
constexpr size_t kMaxLoggedTexts = 100;

/// Newest stamps of one camera, to choose between its transports.
struct LastImages {
  std::optional<Timestamp> raw;
  std::optional<Timestamp> compressed;
};

// In ROS, too, 0 means no limit.
uint32_t queueSize(int size) {
  return static_cast<uint32_t>(size);
}

}  // namespace

struct LiveDriveSource::Implementation {
  Implementation(const ros::NodeHandle& node_handle, std::shared_ptr<const CameraRig> camera_rig,
                 const LiveDriveSourceOptions& live_options)
      : node(node_handle),
        rig(std::move(camera_rig)),
        options(live_options),
        cameras(internal::selectCameras(*rig, options.cameras)),
        monitor(options.max_silence_s, SteadyClock::now()),
        sorter(durationFromSeconds(options.sort_window_s)),
        last_images(rig->cameras.size()) {}

  void subscribe();
  void subscribeImages(size_t camera);
  template <class Message>
  void subscribeTopic(const std::string& topic, int queue_size,
                      std::function<void(const boost::shared_ptr<const Message>&)> callback);

  template <class Convert>
  void handle(const std::string& topic, const ros::Time& ros_stamp, Convert&& convert);
  void take(const std::string& topic, Timestamp stamp, DriveItem item);
  void deliver(Timestamp stamp, const DriveItem& item);
  bool isWanted(size_t camera, bool is_raw, Timestamp stamp);
  void flush();
  void flushWhenIdle();
  void log(DriveMonitor::Change change, const std::string& topic, const std::string& text);

  ros::NodeHandle node;
  const std::shared_ptr<const CameraRig> rig;
  const LiveDriveSourceOptions options;
  const std::vector<size_t> cameras;

  DriveMonitor monitor;  // has its own lock: a report does not wait for the consumer

  std::mutex mutex;  // guards all members below, and serializes the consumer's calls
  DriveConsumer* consumer = nullptr;
  StampSorter<DriveItem> sorter;
  internal::ItemRanks ranks;
  SteadyClock::time_point last_arrival = SteadyClock::now();
  std::vector<LastImages> last_images;  // one per camera
  std::set<std::string> logged;

  // Declared last, so that no callback runs while the other members are destroyed.
  std::vector<ros::Subscriber> subscribers;
  ros::WallTimer idle_timer;
};

template <class Message>
void LiveDriveSource::Implementation::subscribeTopic(
    const std::string& topic, int queue_size,
    std::function<void(const boost::shared_ptr<const Message>&)> callback) {
  subscribers.push_back(subscribePromptly<Message>(&node, topic, queueSize(queue_size), std::move(callback)));
}

void LiveDriveSource::Implementation::subscribeImages(size_t camera) {
  const std::string raw_topic = options.topics.imageTopic(rig->cameras[camera].name);
  const std::string compressed_topic = options.topics.compressedImageTopic(rig->cameras[camera].name);
  const auto add = [this, camera](const std::string& topic, const ros::Time& stamp, const auto& message) {
    handle(topic, stamp, [&] {
      const Image image = toImage(message, topic);
      checkImageSize(rig->cameras[camera], image.pixels.size(), topic);
      return internal::CameraImage{camera, image};
    });
  };
  const ImageTransport transport = options.image_transport;
  // Faults and silence are reported under one name per camera, for either transport.
  const std::string topic = transport == ImageTransport::kCompressed ? compressed_topic : raw_topic;
  monitor.expectTopic(topic);
  if (transport != ImageTransport::kCompressed) {
    subscribeTopic<sensor_msgs::Image>(raw_topic, options.image_queue_size,
                                       [this, add, topic, camera](const sensor_msgs::ImageConstPtr& message) {
                                         const std::lock_guard<std::mutex> lock(mutex);
                                         if (isWanted(camera, true, toTimestamp(message->header.stamp))) {
                                           add(topic, message->header.stamp, message);
                                         }
                                       });
  }
  if (transport != ImageTransport::kRaw) {
    subscribeTopic<sensor_msgs::CompressedImage>(
        compressed_topic, options.image_queue_size,
        [this, add, topic, camera](const sensor_msgs::CompressedImageConstPtr& message) {
          const std::lock_guard<std::mutex> lock(mutex);
          if (isWanted(camera, false, toTimestamp(message->header.stamp))) {
            add(topic, message->header.stamp, message);
          }
        });
  }
}

void LiveDriveSource::Implementation::subscribe() {
  const std::string odometry_topic = options.topics.odometry;
  const std::string ticks_topic = options.topics.wheel_ticks;
  monitor.expectTopic(odometry_topic);
  subscribeTopic<nav_msgs::Odometry>(odometry_topic, options.odometry_queue_size,
                                     [this, odometry_topic](const nav_msgs::OdometryConstPtr& message) {
                                       const std::lock_guard<std::mutex> lock(mutex);
                                       handle(odometry_topic, message->header.stamp, [&] {
                                         return fromMessage(*message, odometry_topic, rig->vehicle_frame);
                                       });
                                     });
  if (!ticks_topic.empty()) {
    subscribeTopic<vcharge_msgs::WheelTicks>(
        ticks_topic, options.odometry_queue_size,
        [this, ticks_topic](const vcharge_msgs::WheelTicksConstPtr& message) {
          const std::lock_guard<std::mutex> lock(mutex);
          handle(ticks_topic, message->header.stamp, [&] { return fromMessage(*message, ticks_topic); });
        });
  }
  for (const size_t camera : cameras) {
    subscribeImages(camera);
  }
  if (options.sort_window_s > 0.0) {
    idle_timer = node.createWallTimer(ros::WallDuration(0.25 * options.idle_flush_s), [this](const auto&) {
      const std::lock_guard<std::mutex> lock(mutex);
      flushWhenIdle();
    });
  }
}

void LiveDriveSource::Implementation::log(DriveMonitor::Change change, const std::string& topic,
                                          const std::string& text) {
  if (change == DriveMonitor::Change::kRecovered) {
    ROS_INFO_STREAM(topic << ": good data again");
  } else if (change == DriveMonitor::Change::kFailed && logged.size() < kMaxLoggedTexts &&
             logged.insert(text).second) {
    ROS_ERROR_STREAM(text);
  }
}

template <class Convert>
void LiveDriveSource::Implementation::handle(const std::string& topic, const ros::Time& ros_stamp,
                                             Convert&& convert) {
  const SteadyClock::time_point now = SteadyClock::now();
  last_arrival = now;
  try {
    const Timestamp stamp = toTimestamp(ros_stamp);
    if (stamp == Timestamp()) {
      throw InputError(topic + ": expected a stamp in the message's header, got 0");
    }
    DriveItem item = convert();
    log(monitor.addGood(topic, stamp, now), topic, "");
    take(topic, stamp, std::move(item));
  } catch (const std::exception& error) {
    log(monitor.addBad(topic, error.what(), now), topic, error.what());
  }
}

void LiveDriveSource::Implementation::take(const std::string& topic, Timestamp stamp, DriveItem item) {
  if (options.sort_window_s <= 0.0) {
    deliver(stamp, item);
    return;
  }
  const auto deliver_item = [this](Timestamp item_stamp, const DriveItem& sorted) {
    deliver(item_stamp, sorted);
  };
  if (sorter.isTooLate(stamp)) {
    ROS_WARN_STREAM(topic << ": stamp " << stamp << " jumped back by " << toSeconds(sorter.newest() - stamp)
                          << " s, more than sort_window_s; starting over");
    sorter.flush(deliver_item);
    sorter.clear();
  }
  const int rank = ranks.rankOf(stamp, item);
  sorter.push(stamp, rank, std::move(item));
  sorter.release(deliver_item);
}

void LiveDriveSource::Implementation::deliver(Timestamp stamp, const DriveItem& item) {
  const SteadyClock::time_point now = SteadyClock::now();
  monitor.beginWork(now);
  try {
    internal::deliver(stamp, item, consumer);
    log(monitor.addGood(kProcessing, std::nullopt, now), kProcessing, "");
  } catch (const std::exception& error) {
    log(monitor.addBad(kProcessing, error.what(), now), kProcessing, error.what());
  }
  monitor.endWork(SteadyClock::now());
}

// Uses the drive's time, so that a slow replay or consumer does not make raw images seem to be missing.
bool LiveDriveSource::Implementation::isWanted(size_t camera, bool is_raw, Timestamp stamp) {
  LastImages& last = last_images[camera];
  if (is_raw) {
    last.raw = stamp;
    return last.compressed != stamp;  // its compressed twin came first
  }
  if (last.raw && std::abs(toSeconds(stamp - *last.raw)) <= options.max_silence_s) {
    return false;
  }
  last.compressed = stamp;
  return true;
}

void LiveDriveSource::Implementation::flushWhenIdle() {
  const double idle_s = std::chrono::duration<double>(SteadyClock::now() - last_arrival).count();
  if (idle_s >= options.idle_flush_s) {
    flush();
  }
}

void LiveDriveSource::Implementation::flush() {
  sorter.flush([this](Timestamp stamp, const DriveItem& item) { deliver(stamp, item); });
}

LiveDriveSource::LiveDriveSource(const ros::NodeHandle& node, std::shared_ptr<const CameraRig> rig,
                                 const LiveDriveSourceOptions& options) {
  check(rig != nullptr, "LiveDriveSource: expected a rig");
  options.validate();
  implementation_ = std::make_unique<Implementation>(node, std::move(rig), options);
}

LiveDriveSource::~LiveDriveSource() = default;

void LiveDriveSource::run(DriveConsumer* consumer, const ProgressCallback& /*progress*/) {
  check(consumer != nullptr, "LiveDriveSource::run: expected a consumer");
  const std::lock_guard<std::mutex> lock(implementation_->mutex);
  check(implementation_->consumer == nullptr, "LiveDriveSource::run: runs already");
  implementation_->consumer = consumer;
  implementation_->subscribe();
}

void LiveDriveSource::flush() {
  const std::lock_guard<std::mutex> lock(implementation_->mutex);
  implementation_->flush();
}

DriveMonitor::Report LiveDriveSource::report() {
  return implementation_->monitor.report(SteadyClock::now());
}

}  // namespace vcharge
