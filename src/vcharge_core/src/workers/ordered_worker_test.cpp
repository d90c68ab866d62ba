#include "vcharge_core/workers/ordered_worker.h"

#include <atomic>
#include <future>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

TEST(OrderedWorkerTest, WorksInTheOrderInWhichTasksCome) {
  std::vector<int> done;
  std::promise<void> finished;
  {
    OrderedWorker<int> worker([&](const int& task) {
      done.push_back(task);
      if (task == 99) {
        finished.set_value();
      }
    });
    for (int i = 0; i < 100; ++i) {
      worker.push(i, i % 2 == 0);
    }
    finished.get_future().wait();
    EXPECT_EQ(worker.numDropped(), 0U);
  }
  ASSERT_EQ(done.size(), 100U);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(done[static_cast<size_t>(i)], i);
  }
}

TEST(OrderedWorkerTest, DropsTheOldestThatMayBeDroppedAndKeepsAllOthers) {
  std::vector<int> done;
  std::promise<void> begun, go_on, finished;
  std::shared_future<void> may_go_on = go_on.get_future().share();
  OrderedWorker<int> worker(
      [&](const int& task) {
        if (task == 0) {
          begun.set_value();
          may_go_on.wait();
        }
        done.push_back(task);
        if (task == 9) {
          finished.set_value();
        }
      },
      OrderedQueue<int>(2));
  worker.push(0, true);
  begun.get_future().wait();
  for (int i = 1; i < 10; ++i) {
    worker.push(i, i % 2 == 0);  // 2, 4, 6, 8 are droppable; 6 and 8 remain
  }
  EXPECT_EQ(worker.numDropped(), 2U);
  go_on.set_value();
  finished.get_future().wait();
  EXPECT_EQ(done, (std::vector<int>{0, 1, 3, 5, 6, 7, 8, 9}));
}

TEST(OrderedWorkerTest, EndsWithTheTaskInWorkAndBeginsNoOther) {
  std::atomic<int> begun{0};
  std::promise<void> in_work, go_on;
  std::shared_future<void> may_go_on = go_on.get_future().share();
  auto worker = std::make_unique<OrderedWorker<int>>([&](const int&) {
    if (++begun == 1) {
      in_work.set_value();
      may_go_on.wait();
    }
  });
  worker->push(0, false);
  worker->push(1, false);
  in_work.get_future().wait();
  std::thread end([&] { worker.reset(); });
  // Lets the destructor run before the task ends.
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  go_on.set_value();
  end.join();
  EXPECT_EQ(begun, 1);
}

}  // namespace
}  // namespace vcharge
