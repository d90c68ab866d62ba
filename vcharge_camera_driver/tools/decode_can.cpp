#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <limits>
#include <sstream>

#include "vcharge_camera_driver/can_wheel_decoder.h"
#include "vcharge_camera_driver/candump_file.h"
#include "vcharge_camera_driver/driver_options.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/trajectory_errors.h"
#include "vcharge_wheel_odometry/wheel_calibration.h"
#include "vcharge_wheel_odometry/wheel_odometry.h"

namespace vcharge {
namespace {

constexpr double kDegreesPerRadian = 57.29577951308232;
constexpr double kDriftDistance_m = 100.0;

struct Arguments {
  std::string log, layout, interface, output, path, poses;
  bool show_options = false;
};

/// The driver's options without its cameras, which a layout need not describe.
DriverOptions readLayout(const std::string& path) {
  YAML::Node layout = loadYamlFile(path);
  if (layout.IsMap()) {
    for (const char* key : {"source", "cameras", "devices", "odometry_source"}) {
      layout.remove(key);
    }
  }
  DriverOptions options;
  options.devices = {"none"};
  options.odometry_source = OdometrySourceKind::kCan;
  readFields(layout, path, &options);
  return options;
}

std::string cell(double value, int digits) {
  return std::isfinite(value) ? "," + toText(value, digits) : ",";
}

std::string csvOf(const std::vector<WheelMeasurement>& wheels) {
  const bool has_speeds = !wheels.empty() && std::holds_alternative<WheelSpeeds>(wheels.front());
  std::string text = has_speeds ? "time_s,rear_left_m_per_s,rear_right_m_per_s,front_left_m_per_s,"
                                  "front_right_m_per_s,steering_angle_rad\n"
                                : "time_s,left_ticks,right_ticks,steering_angle_rad\n";
  for (const WheelMeasurement& each : wheels) {
    text += toString(stampOf(each));
    if (const auto* speeds = std::get_if<WheelSpeeds>(&each)) {
      text += cell(speeds->rear_left_m_per_s, 6) + cell(speeds->rear_right_m_per_s, 6) +
              cell(speeds->front_left_m_per_s, 6) + cell(speeds->front_right_m_per_s, 6) +
              cell(speeds->steering_angle_rad, 9);
    } else {
      const auto& ticks = std::get<WheelTicks>(each);
      text += "," + std::to_string(ticks.left_ticks) + "," + std::to_string(ticks.right_ticks) +
              cell(ticks.steering_angle_rad, 9);
    }
    text += "\n";
  }
  return text;
}

/// Columns of a CSV file by the names in its first line.
std::vector<StampedPosition> readPositions(const std::string& path) {
  constexpr char kExpected[] = "expected a first line with the columns t_s, east_m and north_m";
  std::istringstream text(readTextFile(path));
  std::string line, cell;
  std::getline(text, line);
  const std::vector<std::string> names = {"t_s", "east_m", "north_m"};
  std::vector<size_t> columns(names.size(), std::numeric_limits<size_t>::max());
  std::istringstream header(line);
  for (size_t column = 0; std::getline(header, cell, ','); ++column) {
    for (size_t i = 0; i < names.size(); ++i) {
      columns[i] = cell == names[i] ? column : columns[i];
    }
  }
  for (const size_t column : columns) {
    if (column == std::numeric_limits<size_t>::max()) {
      throw InputError(path + ": " + kExpected);
    }
  }
  std::vector<StampedPosition> positions;
  for (int number = 2; std::getline(text, line); ++number) {
    const std::string where = path + ": line " + std::to_string(number) + ": ";
    std::vector<std::string> cells;
    std::istringstream fields(line);
    while (std::getline(fields, cell, ',')) {
      cells.push_back(cell);
    }
    StampedPosition position;
    try {
      position.stamp = timestampFromString(cells.at(columns[0]));
      position.x_m = std::stod(cells.at(columns[1]));
      position.y_m = std::stod(cells.at(columns[2]));
    } catch (const std::exception&) {
      throw InputError(where + "expected numbers in the columns t_s, east_m and north_m");
    }
    if (!positions.empty() && position.stamp <= positions.back().stamp) {
      throw InputError(where + "t_s: expected increasing times");
    }
    positions.push_back(position);
  }
  return positions;
}

Trajectory readReference(const std::string& path) {
  const bool is_tum = path.size() > 4 && path.substr(path.size() - 4) == ".tum";
  Trajectory reference = is_tum ? readTrajectory(path) : posesFromPositions(readPositions(path));
  if (reference.size() < 2) {
    throw InputError(path + ": expected at least 10 m of positions");
  }
  return reference;
}

Trajectory odometryOf(const std::vector<WheelMeasurement>& wheels, const WheelOdometryOptions& options,
                      WheelOdometryCounts* counts) {
  WheelOdometry odometry(options);
  Trajectory path;
  for (const WheelMeasurement& each : wheels) {
    if (const auto estimate = odometry.add(each)) {
      path.push_back({estimate->odometry.stamp, estimate->odometry.odom_from_vehicle});
    }
  }
  *counts = odometry.counts();
  return path;
}

Trajectory partOf(const Trajectory& trajectory, Timestamp begin, Timestamp end) {
  Trajectory part;
  for (const StampedTransform& pose : trajectory) {
    if (begin <= pose.stamp && pose.stamp < end) {
      part.push_back(pose);
    }
  }
  return part;
}

/// Drift over all sub-paths of 100 m.
nlohmann::json judge(const char* label, const Trajectory& path, const Trajectory& reference) {
  constexpr double kMaxGap_s = 1.5;
  const DriftErrors drift = evaluateDrift(path, reference, kDriftDistance_m, kMaxGap_s);
  const ErrorDistribution& position = drift.translation_percent;
  const ErrorDistribution& rotation = drift.rotation_rad;
  std::printf("  %-10s %6.3f m mean, %6.3f m worst; %6.3f deg mean, %6.3f deg worst (%zu sub-paths)\n", label,
              position.mean, position.max, kDegreesPerRadian * rotation.mean,
              kDegreesPerRadian * rotation.max, position.count);
  return {{"mean_m", position.mean},
          {"worst_m", position.max},
          {"mean_deg", kDegreesPerRadian * rotation.mean},
          {"worst_deg", kDegreesPerRadian * rotation.max},
          {"num_sub_paths", position.count}};
}

nlohmann::json describe(const char* label, const CalibratedParameter& parameter) {
  std::printf("  %-20s %.5f, sigma %.5f%s\n", label, parameter.value, parameter.sigma,
              parameter.is_observable ? "" : ": not observable on this drive, held by its prior");
  return {{"value", parameter.value}, {"sigma", parameter.sigma}, {"is_observable", parameter.is_observable}};
}

/// Calibrates on the first half of the reference and measures the drift on the second half.
void compare(const Arguments& arguments, const std::vector<WheelMeasurement>& wheels,
             const WheelOdometryOptions& nominal, nlohmann::json* found) {
  const Trajectory reference = readReference(arguments.poses);
  const Timestamp begin = reference.front().stamp;
  const Timestamp end = reference.back().stamp + Duration(1);
  const Timestamp middle = begin + (end - begin) / 2;
  std::vector<WheelMeasurement> first_half;
  for (const WheelMeasurement& each : wheels) {
    if (stampOf(each) < middle) {
      first_half.push_back(each);
    }
  }
  const WheelCalibration calibration = calibrateWheels(first_half, partOf(reference, begin, middle), nominal);
  if (!calibration.is_calibrated) {
    throw InputError(arguments.poses + ": first half: " + calibration.reason);
  }
  std::printf("calibrated on the first half, %.1f m:\n", calibration.distance_m);
  (*found)["calibration"] = {{"distance_m", calibration.distance_m},
                             {"scale", describe("scale", calibration.scale)},
                             {"right_over_left", describe("right over left", calibration.right_over_left)},
                             {"track_width_m", describe("track width (m)", calibration.track_width_m)},
                             {"left_scale", calibration.options.left_scale},
                             {"right_scale", calibration.options.right_scale}};
  std::printf("  odometry: {left_scale: %.6f, right_scale: %.6f, track_width_m: %.4f}\n",
              calibration.options.left_scale, calibration.options.right_scale,
              calibration.options.track_width_m);
  const Trajectory second_half = partOf(reference, middle, end);
  std::printf("drift per %.0f m on the second half:\n", kDriftDistance_m);
  WheelOdometryCounts counts;
  for (const bool is_calibrated : {false, true}) {
    const char* label = is_calibrated ? "calibrated" : "nominal";
    const Trajectory path = odometryOf(wheels, is_calibrated ? calibration.options : nominal, &counts);
    (*found)["drift"][label] = judge(label, partOf(path, middle, end), second_half);
  }
}

void decode(const Arguments& arguments, nlohmann::json* found) {
  const DriverOptions options = readLayout(arguments.layout);
  const std::vector<StampedCanFrame> frames = readCandump(arguments.log, arguments.interface);
  CanWheelDecoder decoder(options.can);
  std::vector<WheelMeasurement> wheels;
  for (const StampedCanFrame& each : frames) {
    if (const auto measurement = decoder.add(each.frame, each.stamp)) {
      wheels.push_back(*measurement);
    }
  }
  if (wheels.empty()) {
    throw InputError(arguments.log + ": has no frame with the wheels' messages of " + arguments.layout);
  }
  WheelOdometryCounts counts;
  const Trajectory path = odometryOf(wheels, options.odometry, &counts);
  const CanWheelCounts& decoded = decoder.counts();
  double distance_m = 0.0;
  for (size_t i = 1; i < path.size(); ++i) {
    distance_m +=
        (path[i].world_from_vehicle.translation() - path[i - 1].world_from_vehicle.translation()).norm();
  }
  const double duration_s = toSeconds(path.back().stamp - path.front().stamp);
  *found = {{"frames", frames.size()},  {"measurements", wheels.size()},  {"duration_s", duration_s},
            {"distance_m", distance_m}, {"too_short", decoded.too_short}, {"wraps", decoded.wraps},
            {"resets", decoded.resets}, {"invalid", decoded.invalid},     {"gaps", counts.gaps},
            {"slips", counts.slips}};
  std::printf(
      "%zu frames, %zu wheel measurements in %.1f s, %.1f m; %llu gaps, %llu slips, %llu messages "
      "too short, %llu counter resets, %llu invalid speeds\n",
      frames.size(), wheels.size(), duration_s, distance_m, static_cast<unsigned long long>(counts.gaps),
      static_cast<unsigned long long>(counts.slips), static_cast<unsigned long long>(decoded.too_short),
      static_cast<unsigned long long>(decoded.resets), static_cast<unsigned long long>(decoded.invalid));
  if (!arguments.output.empty()) {
    writeTextFileAtomically(arguments.output, csvOf(wheels));
  }
  if (!arguments.path.empty()) {
    writeTrajectory(path, arguments.path);
  }
  if (!arguments.poses.empty()) {
    compare(arguments, wheels, options.odometry, found);
  }
}

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  vcharge::Arguments arguments;
  vcharge::CommandLine app(
      "Decodes the wheels' messages of a CAN log as the driver does, and computes the car's path from them. "
      "With --poses, calibrates the wheels on the first half of the reference and measures the drift on the "
      "second half.");
  app.addOption("--log", &arguments.log, "log, by candump -l or candump -L").required();
  app.addOption("--layout", &arguments.layout,
                "options of the driver (config/driver); `can` and `odometry` are used")
      .required();
  app.addOption("--interface", &arguments.interface, "bus of the wheels in a log of several, such as can0");
  app.addOption("--output", &arguments.output, "CSV file for the decoded values")
      .check(vcharge::requireOutput);
  app.addOption("--path", &arguments.path, "file for the path (.tum)").check(vcharge::requireOutput);
  app.addOption(
      "--poses", &arguments.poses,
      "reference of the rear axle's centre: .tum, or CSV with t_s, east_m and north_m of a car that "
      "drives forwards");
  vcharge::addShowOptions(&app, &arguments.show_options);
  app.setFooter(
      "Keys of --json: frames, measurements, duration_s, distance_m, too_short, wraps, resets, invalid, "
      "gaps, "
      "slips; with --poses: calibration {distance_m, left_scale, right_scale, and scale, right_over_left, "
      "track_width_m with value, sigma, is_observable}, drift per 100 m {nominal, calibrated: mean_m, "
      "worst_m, "
      "mean_deg, worst_deg, num_sub_paths}.");
  return vcharge::runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (arguments.show_options) {
      std::cout << showOptions(arguments.layout.empty() ? vcharge::DriverOptions()
                                                        : vcharge::readLayout(arguments.layout));
      return;
    }
    vcharge::decode(arguments, found);
  });
}
