#include "vcharge_ros/nodelet.h"

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nodelet/detail/callback_queue.h>
#include <nodelet/loader.h>
#include <ros/callback_queue_interface.h>
#include <ros/node_handle.h>
#include <boost/make_shared.hpp>
#include <boost/weak_ptr.hpp>

#include "vcharge_ros/nodelet_support.h"

namespace vcharge {
namespace {

using std::chrono_literals::operator""s;

/// State of the queues when a nodelet is destroyed.
struct End {
  bool single_threaded_queue_lives = false, multi_threaded_queue_lives = false;
  std::thread::id thread;
};

/// Calls `work` in a callback of its own queue; throws in start() if `work` is empty.
class TestNodelet : public Nodelet {
 public:
  TestNodelet(std::function<void()> work, std::promise<End>* end)
      : Nodelet("test"), work_(std::move(work)), end_of_nodelet_(end) {}
  ~TestNodelet() override {
    End end;
    end.single_threaded_queue_lives = !single_threaded_.expired();
    end.multi_threaded_queue_lives = !multi_threaded_.expired();
    end.thread = std::this_thread::get_id();
    end_of_nodelet_->set_value(end);
  }

 private:
  static boost::weak_ptr<nodelet::detail::CallbackQueue> watch(ros::CallbackQueueInterface* queue) {
    return dynamic_cast<nodelet::detail::CallbackQueue&>(*queue).shared_from_this();
  }

  void start() override {
    single_threaded_ = watch(&getSTCallbackQueue());
    multi_threaded_ = watch(&getMTCallbackQueue());
    if (!work_) {
      throw std::runtime_error("nothing to do");
    }
    timer_ = getNodeHandle().createWallTimer(
        ros::WallDuration(0.001), [this](const ros::WallTimerEvent& /*event*/) { work_(); }, true);
  }

  const std::function<void()> work_;
  std::promise<End>* const end_of_nodelet_;
  boost::weak_ptr<nodelet::detail::CallbackQueue> single_threaded_, multi_threaded_;
  ros::WallTimer timer_;
};

/// Loads nodelets that do `work`, and waits for the destruction of the first.
class NodeletTest : public ::testing::Test {
 protected:
  bool load(std::function<void()> work) {
    loader_ = std::make_unique<nodelet::Loader>([this, work = std::move(work)](const std::string& /*type*/) {
      return boost::make_shared<TestNodelet>(work, &end_);
    });
    return loader_->load("/test", "test", {}, {});
  }

  End waitForEnd() {
    std::future<End> end = end_.get_future();
    EXPECT_EQ(end.wait_for(30s), std::future_status::ready);
    return end.get();
  }

  ros::NodeHandle node_;
  std::promise<End> end_;
  std::unique_ptr<nodelet::Loader> loader_;
};

TEST_F(NodeletTest, UnloadedWhileACallbackRunsItGoesBeforeItsQueues) {
  std::promise<void> begun, unloaded;
  ASSERT_TRUE(load([&] {
    begun.set_value();
    unloaded.get_future().wait();
  }));
  ASSERT_EQ(begun.get_future().wait_for(30s), std::future_status::ready);
  EXPECT_TRUE(loader_->unload("/test"));
  unloaded.set_value();
  const End end = waitForEnd();
  EXPECT_NE(end.thread, std::this_thread::get_id());  // destroyed in the callback's thread, after unload()
  EXPECT_TRUE(end.single_threaded_queue_lives);
  EXPECT_TRUE(end.multi_threaded_queue_lives);
}

TEST_F(NodeletTest, FailingToInitializeItGoesBeforeItsQueues) {
  bool loaded = false;
  try {
    loaded = load(nullptr);
  } catch (const std::exception&) {
  }
  EXPECT_FALSE(loaded);
  EXPECT_TRUE(loader_->listLoadedNodelets().empty());
  const End end = waitForEnd();
  EXPECT_TRUE(end.single_threaded_queue_lives);
  EXPECT_TRUE(end.multi_threaded_queue_lives);
}

TEST(AdvertiseTriggerTest, ANameThatIsServedAlreadyIsRefusedUntilItIsFree) {
  ros::NodeHandle node("/trigger_test");
  CallbackGuard guard("trigger_test");
  const auto serve = [](std_srvs::TriggerResponse* response) { response->success = 1; };
  ros::ServiceServer first = advertiseTrigger(&node, "finish", &guard, serve);
  try {
    advertiseTrigger(&node, "finish", &guard, serve);
    FAIL() << "served twice";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("/trigger_test/finish"));
  }
  first.shutdown();
  EXPECT_TRUE(advertiseTrigger(&node, "finish", &guard, serve));
}

}  // namespace
}  // namespace vcharge
