#include <cstdio>

#include "vcharge_camera_driver/can_wheel_options.h"
#include "vcharge_camera_driver/dbc_file.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295;

struct Arguments {
  std::string dbc, output;
  std::string left_ticks, right_ticks, rear_left, rear_right, front_left, front_right, backwards;
  std::vector<std::string> steering;
  double steering_ratio = 1.0;
  std::string speed_unit, angle_unit;
};

double speedUnit(const std::string& unit) {
  return unit == "m/s"                                                                          ? 1.0
         : unit == "km/h" || unit == "kph" || unit == "kmh" || unit == "KPH" || unit == "km/hr" ? 1.0 / 3.6
         : unit == "mph" || unit == "MPH"                                                       ? 0.44704
                                                                                                : 0.0;
}

double angleUnit(const std::string& unit) {
  return unit == "rad" ? 1.0
         : unit == "deg" || unit == "degree" || unit == "degrees" || unit == "\xc2\xb0" || unit == "\xb0"
             ? kRadiansPerDegree
             : 0.0;
}

class Importer {
 public:
  explicit Importer(const Arguments& arguments) : arguments_(arguments), dbc_(DbcFile::read(arguments.dbc)) {}

  CanSignal counter(const std::string& name) const {
    CanSignal signal = dbc_.layoutOf(name);
    signal.scale = 1.0;  // metres_per_tick has the distance
    signal.offset = 0.0;
    return signal;
  }
  CanSignal speed(const std::string& name) const {
    return scaled(name, arguments_.speed_unit, speedUnit, "m/s, km/h or mph", "--speed-unit");
  }
  CanSignal steering() const {
    const auto part = [&](const std::string& name) {
      CanSignal signal = scaled(name, arguments_.angle_unit, angleUnit, "deg or rad", "--angle-unit");
      signal.scale /= arguments_.steering_ratio;
      signal.offset /= arguments_.steering_ratio;
      return signal;
    };
    CanSignal sum = part(arguments_.steering.at(0));
    if (arguments_.steering.size() == 2) {
      const CanSignal second = part(arguments_.steering[1]);
      if (second.id != sum.id) {
        throw InputError(arguments_.dbc + ": " + arguments_.steering[1] +
                         ": expected a signal of the message of " + arguments_.steering[0] +
                         ", to which it is added");
      }
      sum.plus = second;
    }
    return sum;
  }
  CanSignal plain(const std::string& name) const { return dbc_.layoutOf(name); }

 private:
  CanSignal scaled(const std::string& name, const std::string& given_unit,
                   double (*factorOf)(const std::string&), const std::string& expected,
                   const std::string& option) const {
    CanSignal signal = dbc_.layoutOf(name);
    const std::string unit = given_unit.empty() ? dbc_.unitOf(name) : given_unit;
    const double factor = factorOf(unit);
    if (factor == 0.0) {
      throw InputError(arguments_.dbc + ": " + name + ": expected the unit " + expected + ", got '" + unit +
                       "' (" + option + " replaces it)");
    }
    signal.scale *= factor;
    signal.offset *= factor;
    return signal;
  }

  const Arguments& arguments_;
  const DbcFile dbc_;
};

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.15g", value);
  return text;
}

std::string describe(const CanNumber& part) {
  return "start_bit: " + std::to_string(part.start_bit) + ", length: " + std::to_string(part.length) +
         (part.endianness == ByteOrder::kBig ? ", endianness: big" : "") +
         (part.is_signed ? ", is_signed: true" : "") +
         (part.scale != 1.0 ? ", scale: " + number(part.scale) : "") +
         (part.offset != 0.0 ? ", offset: " + number(part.offset) : "");
}

std::string describe(const CanSignal& signal) {
  char id[16];
  std::snprintf(id, sizeof(id), "0x%03x", static_cast<unsigned>(signal.id));
  std::string text = "{id: " + std::string(id) + ", " + describe(static_cast<const CanNumber&>(signal));
  if (signal.plus.isThere()) {
    text += ",\n    plus: {" + describe(signal.plus) + "}";
  }
  if (signal.multiplexor.length > 0) {
    text += ",\n    multiplexor: {" + describe(signal.multiplexor.number()) +
            ", value: " + std::to_string(signal.multiplexor.value) + "}";
  }
  return text + "}";
}

void import(const Arguments& arguments, nlohmann::json* found) {
  const Importer importer(arguments);
  CanWheelOptions options;
  const auto set = [](const std::string& name, CanSignal* signal, const auto& layout) {
    if (!name.empty()) {
      *signal = layout(name);
    }
  };
  const auto counter = [&](const std::string& name) { return importer.counter(name); };
  const auto speed = [&](const std::string& name) { return importer.speed(name); };
  set(arguments.left_ticks, &options.left_ticks, counter);
  set(arguments.right_ticks, &options.right_ticks, counter);
  set(arguments.rear_left, &options.left_speed_m_per_s, speed);
  set(arguments.rear_right, &options.right_speed_m_per_s, speed);
  set(arguments.front_left, &options.front_left_speed_m_per_s, speed);
  set(arguments.front_right, &options.front_right_speed_m_per_s, speed);
  set(arguments.backwards, &options.backwards, [&](const std::string& name) { return importer.plain(name); });
  if (!arguments.steering.empty()) {
    options.steering_angle_rad = importer.steering();
  }
  if (!options.isUsed()) {
    throw InputError("expected --rear-left and --rear-right, or --left-ticks and --right-ticks");
  }
  try {
    options.validate();
  } catch (const std::invalid_argument& error) {
    throw InputError(arguments.dbc + ": " + error.what());
  }
  std::string text = "# Made by import_dbc from " + arguments.dbc +
                     ". Part of the driver's options.\n"
                     "odometry_source: can\ncan:\n";
  (*found)["signals"] = nlohmann::json::array();
  for (const auto& [name, signal] : options.usedSignals()) {
    text += "  " + name + ": " + describe(*signal) + "\n";
    (*found)["signals"].push_back(name);
  }
  if (!options.steering_angle_rad.isUsed()) {
    text += "odometry:\n  use_steering: false\n";
  }
  writeTextFileAtomically(arguments.output, text);
}

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  vcharge::Arguments arguments;
  vcharge::CommandLine app(
      "Turns signals of a DBC file, each named MESSAGE.SIGNAL, into the driver's description of the car's "
      "messages.");
  app.addOption("--dbc", &arguments.dbc, "DBC file").required();
  app.addOption("--output", &arguments.output, "file for the description (YAML)")
      .required()
      .check(vcharge::requireOutput);
  app.addOption("--rear-left", &arguments.rear_left, "speed of the left rear wheel");
  app.addOption("--rear-right", &arguments.rear_right, "speed of the right rear wheel");
  app.addOption("--front-left", &arguments.front_left, "speed of the left front wheel");
  app.addOption("--front-right", &arguments.front_right, "speed of the right front wheel");
  app.addOption("--left-ticks", &arguments.left_ticks, "counter of the left rear wheel, instead of speeds");
  app.addOption("--right-ticks", &arguments.right_ticks, "counter of the right rear wheel");
  app.addOption("--backwards", &arguments.backwards, "not 0 where the car rolls backwards");
  app.addOption("--steering", &arguments.steering,
                "steering angle, positive to the left; two signals are added")
      .expected(1, 2);
  app.addOption("--steering-ratio", &arguments.steering_ratio,
                "angle of --steering over the front wheels' angle, negative if it is positive to the right")
      .check([](const std::string& text) {
        return std::strtod(text.c_str(), nullptr) == 0.0 ? std::string("must not be 0") : std::string();
      });
  app.addOption("--speed-unit", &arguments.speed_unit, "unit of the speeds in place of the file's");
  app.addOption("--angle-unit", &arguments.angle_unit, "unit of the steering in place of the file's");
  app.setFooter("Keys of --json: signals (names of the driver's options that were written).");
  return vcharge::runTool(&app, argc, argv,
                          [&](nlohmann::json* found) { vcharge::import(arguments, found); });
}
