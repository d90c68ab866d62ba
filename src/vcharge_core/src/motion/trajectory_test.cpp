#include "vcharge_core/motion/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string errorOf(const std::string& text) {
  const std::string path = ::testing::TempDir() + "bad_trajectory.tum";
  writeTextFileAtomically(path, text);
  try {
    readTrajectory(path);
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(path));
    return error.what();
  }
  return "no error";
}

TEST(TrajectoryTest, SurvivesWritingAndReading) {
  const std::string path = ::testing::TempDir() + "trajectory_test.tum";
  Trajectory trajectory;
  for (int i = 0; i < 5; ++i) {
    trajectory.push_back({Timestamp::fromNanoseconds(1342626148354042001 + i),
                          RigidTransform(Eigen::Quaterniond(1.0, 0.1 * i, -0.2, 0.3),
                                         Eigen::Vector3d(1e3 + i / 3.0, -2.0, 0.1))});
  }
  writeTrajectory(trajectory, path);
  const Trajectory read = readTrajectory(path);
  ASSERT_EQ(read.size(), trajectory.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].stamp, trajectory[i].stamp);
    EXPECT_LE((read[i].world_from_vehicle.matrix() - trajectory[i].world_from_vehicle.matrix()).norm(), 1e-8);
  }
}

TEST(TrajectoryTest, ErrorsNameFileAndLine) {
  EXPECT_THAT(errorOf("# only a comment\n\n"), HasSubstr("got none"));
  EXPECT_THAT(errorOf("# comment\n1.0 0 0 0 0 0 0\n"), AllOf(HasSubstr("line 2"), HasSubstr("time_s tx")));
  EXPECT_THAT(errorOf("1.0 0 0 0 0 0 0 1 5\n"), HasSubstr("eight numbers"));
  EXPECT_THAT(errorOf("1.0 0 0 nan 0 0 0 1\n"), HasSubstr("line 1"));
  EXPECT_THAT(errorOf("1.0 0 0 0 0 0 0 2\n"), HasSubstr("unit quaternion"));
  EXPECT_THAT(errorOf("2.0 0 0 0 0 0 0 1\n1.0 0 0 0 0 0 0 1\n"),
              AllOf(HasSubstr("line 2"), HasSubstr("increasing")));
  EXPECT_THAT(errorOf("x 0 0 0 0 0 0 1\n"), HasSubstr("line 1"));
}

}  // namespace
}  // namespace vcharge
