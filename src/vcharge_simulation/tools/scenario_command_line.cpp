#include "scenario_command_line.h"

#include <algorithm>
#include <optional>
#include <sstream>
#include <type_traits>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"
#include "vcharge_simulation/sensors/rig_catalogue.h"

namespace vcharge {

namespace {

void describe(const std::vector<CatalogueEntry>& entries, const std::string& indent, std::ostream* stream) {
  for (const CatalogueEntry& entry : entries) {
    *stream << indent << entry.name << ": " << entry.description << "\n";
  }
}

std::vector<CatalogueEntry> listFaults() {
  std::vector<CatalogueEntry> entries;
  const FaultOptions faults;
  forEachOption(faults, [&](const OptionDeclaration& fault, const auto& options) {
    std::string keys;
    forEachOption(options, [&](const OptionDeclaration& option, const auto& /*value*/) {
      keys += (keys.empty() ? "" : ", ") + std::string(option.name);
    });
    entries.push_back({fault.name, std::string(fault.meaning) + " [" + keys + "]"});
  });
  return entries;
}

}  // namespace

ScenarioCommandLine::ScenarioCommandLine(CommandLine* app) {
  app->addOption("--scenario", &file_, "YAML file of the scenario; options override it");
  add(app, &DriveScenario::scene);
  add(app, &DriveScenario::drive);
  add(app, &DriveScenario::rig);
  add(app, &DriveScenario::board);
  add(app, &DriveScenario::scene_seed);
  add(app, &DriveScenario::rig_seed);
  add(app, &DriveScenario::day);
  add(app, &DriveScenario::exchanged_cars);
  add(app, &DriveScenario::seed);
  add(app, &DriveScenario::sensor_seed);
  add(app, &DriveScenario::exposure_gain);
  add(app, &DriveScenario::image_scale);
  add(app, &DriveScenario::image_step);
  add(app, &DriveScenario::duration_s);
  add(app, &DriveScenario::cameras).delimiter(',');
  const CommandLine::Option noise =
      app->addOption("--noise", &noise_, "Add sensor noise to the images: on or off.")
          .oneOf({"on", "off"})
          .showDefault();
  overrides_.emplace_back([this, noise](DriveScenario* scenario) {
    if (noise.isGiven()) {
      scenario->noise = noise_ == "on";
    }
  });
  app->addOption("--set", &settings_,
                 "KEY=VALUE for any key of --show-options, as in faults.dead_camera.cameras=[left]");
}

template <class T>
CommandLine::Option ScenarioCommandLine::add(CommandLine* app, T DriveScenario::*field) {
  std::optional<CommandLine::Option> option;
  forEachOption(given_, [&](const OptionDeclaration& declared, auto& value) {
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, T>) {
      if (&value == &(given_.*field)) {
        std::string name = declared.name;
        std::replace(name.begin(), name.end(), '_', '-');
        option = app->addOption("--" + name, &value, declared.meaning).showDefault();
      }
    }
  });
  overrides_.emplace_back([this, option = *option, field](DriveScenario* scenario) {
    if (option.isGiven()) {
      scenario->*field = given_.*field;
    }
  });
  return *option;
}

DriveScenario ScenarioCommandLine::scenario() const {
  DriveScenario scenario;
  if (!file_.empty()) {
    readFieldsFromFile(file_, &scenario);
  }
  for (const std::function<void(DriveScenario*)>& apply : overrides_) {
    apply(&scenario);
  }
  for (const std::string& setting : settings_) {
    setField(setting, &scenario);
  }
  scenario.validate();
  return scenario;
}

void setField(const std::string& setting, DriveScenario* scenario) {
  const size_t equals = setting.find('=');
  if (equals == 0 || equals == std::string::npos) {
    throw InputError("--set: expected KEY=VALUE, got '" + setting + "'");
  }
  YAML::Node node;
  try {
    node = YAML::Load(setting.substr(equals + 1));
  } catch (const YAML::Exception& error) {
    throw InputError("--set: " + setting + ": not valid YAML: " + error.msg);
  }
  std::string key = setting.substr(0, equals);
  while (!key.empty()) {
    const size_t dot = key.rfind('.');
    YAML::Node outer(YAML::NodeType::Map);
    outer[dot == std::string::npos ? key : key.substr(dot + 1)] = node;
    node.reset(outer);
    key = dot == std::string::npos ? "" : key.substr(0, dot);
  }
  readFields(node, "--set", scenario);
}

std::string describeCatalogue() {
  std::ostringstream text;
  text << "scenes (--scene) and their drives (--drive):\n";
  for (const CatalogueEntry& scene : listScenes()) {
    describe({scene}, "  ", &text);
    describe(listDrives(scene.name), "    ", &text);
  }
  text << "rigs (--rig):\n";
  describe(listRigs(), "  ", &text);
  text << "faults (--set faults.NAME.KEY=VALUE):\n";
  describe(listFaults(), "  ", &text);
  return text.str();
}

}  // namespace vcharge
