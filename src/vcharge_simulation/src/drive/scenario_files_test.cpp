#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "vcharge_core/base/options.h"
#include "vcharge_simulation/drive/drive_scenario.h"
#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {
namespace {

std::map<std::string, DriveScenario> readScenarios() {
  std::map<std::string, DriveScenario> scenarios;
  for (const auto& file : std::filesystem::directory_iterator(VCHARGE_SCENARIOS_DIR)) {
    readFieldsFromFile(file.path().string(), &scenarios[file.path().stem().string()]);
  }
  return scenarios;
}

SimulatedDrive drive(const DriveScenario& scenario) {
  const DrivePlan plan = planDrive(scenario.scene, scenario.drive);
  return simulateDrive(plan.path, plan.motion, scenario.odometer, static_cast<uint64_t>(scenario.seed),
                       scenario.sensorSeed(), scenario.faults, plan.ground_height);
}

double durationOf(const SimulatedDrive& drive) {
  return 1e-9 *
         static_cast<double>((drive.ground_truth.back().stamp - drive.ground_truth.front().stamp).count());
}

// Mean position error of odometry over stretches of 100 m, relative to their length.
double driftOf(const SimulatedDrive& drive) {
  constexpr double kStretch_m = 100.0;
  OdometryBufferOptions options;
  options.history_s = std::numeric_limits<double>::infinity();
  OdometryBuffer odometry(options);
  for (const Received<VehicleOdometry>& entry : drive.odometry) {
    odometry.add(entry.message);
  }
  std::vector<double> travelled_m(1, 0.0);
  for (size_t i = 1; i < drive.ground_truth.size(); ++i) {
    travelled_m.push_back(travelled_m.back() + (drive.ground_truth[i].odom_from_vehicle.translation() -
                                                drive.ground_truth[i - 1].odom_from_vehicle.translation())
                                                   .norm());
  }
  double sum = 0.0;
  int count = 0;
  size_t end = 0;
  for (size_t i = 0; i < travelled_m.size(); i += 50) {
    while (end < travelled_m.size() && travelled_m[end] < travelled_m[i] + kStretch_m) {
      ++end;
    }
    if (end == travelled_m.size()) {
      break;
    }
    const OdometryBuffer::Lookup from = odometry.lookup(drive.ground_truth[i].stamp);
    const OdometryBuffer::Lookup to = odometry.lookup(drive.ground_truth[end].stamp);
    if (!from || !to) {
      continue;
    }
    const auto motion = [](const VehicleOdometry& first, const VehicleOdometry& last) {
      return (first.odom_from_vehicle.inverse() * last.odom_from_vehicle).translation().eval();
    };
    sum += (motion(from.odometry, to.odometry) - motion(drive.ground_truth[i], drive.ground_truth[end]))
               .head<2>()
               .norm() /
           kStretch_m;
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

TEST(ScenarioFilesTest, EveryFileIsAScenarioOfTheCatalogue) {
  const std::map<std::string, DriveScenario> scenarios = readScenarios();
  EXPECT_GT(scenarios.size(), 20U);
  for (const auto& [name, scenario] : scenarios) {
    EXPECT_NO_THROW(scenario.validate()) << name;
    EXPECT_NO_THROW(planDrive(scenario.scene, scenario.drive)) << name;
  }
}

TEST(ScenarioFilesTest, EveryConditionHasAFile) {
  const std::map<std::string, DriveScenario> scenarios = readScenarios();
  for (const std::string& condition : enumNames<ConditionKind>()) {
    if (condition != "noon") {
      const DriveScenario& scenario = scenarios.at("condition_" + condition);
      EXPECT_EQ(enumNames<ConditionKind>()[static_cast<size_t>(scenario.condition.kind)], condition);
      EXPECT_TRUE(scenario.activeFaults().auto_exposure.isActive());
    }
  }
}

TEST(ScenarioFilesTest, MappingDrivesLastLongDriveLanesInBothDirectionsAndDrift) {
  for (const auto& [name, scenario] : readScenarios()) {
    if (name.rfind("mapping_", 0) != 0) {
      continue;
    }
    const SimulatedDrive simulated = drive(scenario);
    RecordProperty(name + "_duration_s", static_cast<int>(durationOf(simulated)));
    EXPECT_GE(durationOf(simulated), 120.0) << name;
    const double drift = driftOf(simulated);
    RecordProperty(name + "_drift_per_mille", static_cast<int>(1000.0 * drift));
    EXPECT_GE(drift, 0.01) << name;
    EXPECT_LE(drift, 0.04) << name;
    // Directions of travel (along x or y, to the nearest quarter turn) in each cell of 5 x 5 m.
    std::map<std::pair<int, int>, std::set<int>> directions;
    for (const VehicleOdometry& truth : simulated.ground_truth) {
      const Eigen::Vector3d position_m = truth.odom_from_vehicle.translation();
      const double yaw_rad = yawOfRotation(truth.odom_from_vehicle.rotation());
      const int quarter = static_cast<int>(std::lround(yaw_rad / 1.57079632679)) & 3;
      directions[{static_cast<int>(std::floor(position_m.x() / 5.0)),
                  static_cast<int>(std::floor(position_m.y() / 5.0))}]
          .insert(quarter);
    }
    int both = 0;
    for (const auto& [cell, quarters] : directions) {
      both +=
          (quarters.count(0) + quarters.count(2) == 2 || quarters.count(1) + quarters.count(3) == 2) ? 1 : 0;
    }
    RecordProperty(name + "_percent_both",
                   static_cast<int>(100 * both / static_cast<int>(directions.size())));
    EXPECT_GE(both, 0.6 * static_cast<double>(directions.size())) << name;
  }
}

TEST(ScenarioFilesTest, EveryMappedSceneHasAnotherDayBesideAndInTheOppositeDirection) {
  const std::map<std::string, DriveScenario> scenarios = readScenarios();
  for (const char* scene : {"lot", "garage", "two_levels"}) {
    for (const char* kind : {"other_day_", "opposite_direction_"}) {
      const DriveScenario& scenario = scenarios.at(std::string(kind) + scene);
      EXPECT_EQ(scenario.scene, scene);
      EXPECT_EQ(planDrive(scenario.scene, scenario.drive).day, 1);
      EXPECT_NE(scenario.seed, scenarios.at(std::string("mapping_") + scene).seed);
      const SimulatedDrive simulated = drive(scenario);
      EXPECT_GE(driftOf(simulated), 0.01) << scene;
      // The drive runs beside the mapped loop; measured in the middle of the southern lane.
      const SimulatedDrive mapped = drive(scenarios.at(std::string("mapping_") + scene));
      const auto southern_y = [](const SimulatedDrive& drive) {
        double y = 0.0;
        for (const VehicleOdometry& truth : drive.ground_truth) {
          const Eigen::Vector3d position_m = truth.odom_from_vehicle.translation();
          y = std::abs(position_m.x() - 5.0) < 1.0 && position_m.y() < -10.0 ? position_m.y() : y;
        }
        return y;
      };
      EXPECT_NEAR(std::abs(southern_y(simulated) - southern_y(mapped)), 2.0, 0.3) << kind << scene;
    }
  }
}

}  // namespace
}  // namespace vcharge
