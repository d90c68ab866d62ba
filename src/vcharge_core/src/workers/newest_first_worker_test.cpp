#include "vcharge_core/workers/newest_first_worker.h"

#include <chrono>
#include <future>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

using Tasks = std::vector<std::string>;

/// A worker whose first task, "begin" of channel 0, blocks until letGo(); records all tasks.
class HeldWorker {
 public:
  HeldWorker() {
    worker_.emplace([this](const std::string& task) { work(task); });
    worker_->push(0, "begin");
    began_.get_future().wait();
  }

  NewestFirstWorker<std::string>& worker() { return *worker_; }
  /// Pushes `next` while `task` is processed.
  void follow(const std::string& task, size_t channel, const std::string& next) {
    next_[task] = {channel, next};
  }
  void letGo() { released_.set_value(); }
  /// Waits for the task "end" and returns all tasks in order.
  Tasks tasks() {
    ended_.get_future().wait();
    return tasks_;
  }

 private:
  void work(const std::string& task) {
    tasks_.push_back(task);
    if (task == "begin") {
      began_.set_value();
      released_.get_future().wait();
    }
    if (const auto found = next_.find(task); found != next_.end()) {
      worker_->push(found->second.first, found->second.second);
    }
    if (task == "end") {
      ended_.set_value();
    }
  }

  std::promise<void> began_, released_, ended_;
  Tasks tasks_;
  std::map<std::string, std::pair<size_t, std::string>> next_;
  std::optional<NewestFirstWorker<std::string>> worker_;  // last, since its thread uses the other members
};

TEST(NewestFirstWorkerTest, ANewerTaskReplacesOneThatWaitsAndTheDropIsCounted) {
  HeldWorker held;
  held.worker().push(1, "old");
  held.worker().push(1, "older than the last");
  held.worker().push(1, "newest");
  held.worker().push(2, "of another channel");
  held.worker().push(0, "end");
  EXPECT_EQ(held.worker().numDropped(1), 2u);
  EXPECT_EQ(held.worker().numDropped(2), 0u);
  EXPECT_EQ(held.worker().numDropped(0), 0u) << "what is worked on is not dropped";
  EXPECT_EQ(held.worker().numDropped(7), 0u) << "a channel that brought nothing";
  held.letGo();
  EXPECT_EQ(held.tasks(), (Tasks{"begin", "newest", "of another channel", "end"}));
}

TEST(NewestFirstWorkerTest, ChannelsTakeTurns) {
  HeldWorker held;
  held.worker().push(1, "first of 1");
  held.worker().push(2, "first of 2");
  held.worker().push(3, "first of 3");
  held.follow("first of 1", 1, "second of 1");
  held.follow("second of 1", 0, "end");
  held.letGo();
  EXPECT_EQ(held.tasks(), (Tasks{"begin", "first of 1", "first of 2", "first of 3", "second of 1", "end"}));
}

TEST(NewestFirstWorkerTest, TheDestructorWaitsForTheTaskInWork) {
  std::promise<void> began;
  bool is_done = false;
  {
    NewestFirstWorker<int> worker([&](const int&) {
      began.set_value();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      is_done = true;
    });
    worker.push(0, 1);
    began.get_future().wait();
  }
  EXPECT_TRUE(is_done);
}

TEST(NewestFirstWorkerTest, AWorkerWithoutTasksEnds) {
  int num_tasks = 0;
  {
    const NewestFirstWorker<int> worker([&](const int&) { ++num_tasks; });
  }
  EXPECT_EQ(num_tasks, 0);
}

}  // namespace
}  // namespace vcharge
