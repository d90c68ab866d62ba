#include "scenes/movers/ways/speed_schedule.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

TEST(SpeedScheduleTest, WaitsWhereItMustAndSaysWhenThereIsNoWay) {
  ScheduleTask task;
  task.path_m = 10.0;
  task.num_steps = 40;
  task.speed_limit_m_per_s = [](double) { return 10.0; };
  task.wanted_m_per_s = [&](int) { return task.max_speed_m_per_s; };
  // The path is closed between 4 and 5 m until 12 s.
  task.is_free = [](int step, double along_m) {
    return along_m < 4.0 || along_m > 5.0 || SpeedSchedule::kStep_s * step > 12.0;
  };
  const std::optional<SpeedSchedule> schedule = planSchedule(task);
  ASSERT_TRUE(schedule);
  EXPECT_LT(schedule->at(12.0).along_m, 4.0);
  EXPECT_GT(schedule->at(12.0).along_m, 2.0);
  EXPECT_GT(schedule->at(20.0).along_m, 5.0);
  task.is_free = [](int step, double) { return SpeedSchedule::kStep_s * step < 12.0; };
  EXPECT_FALSE(planSchedule(task));
}

}  // namespace
}  // namespace vcharge
