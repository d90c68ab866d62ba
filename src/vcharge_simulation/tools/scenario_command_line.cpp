#include "scenario_command_line.h"

#include <sstream>

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

// Appends the keys of each fault to its description.
struct FaultDescriber {
  std::vector<CatalogueEntry> entries = listFaults();
  size_t next = 0;
  template <class Fault>
  void operator()(const char*, Fault& fault) {
    internal::NameCollector keys;
    fault.visitFields(keys);
    std::string list;
    for (const std::string& key : keys.names) {
      list += (list.empty() ? "" : ", ") + key;
    }
    entries.at(next++).description += " [" + list + "]";
  }
};

}  // namespace

ScenarioCommandLine::ScenarioCommandLine(CLI::App* app) {
  app->add_option("--scenario", file_, "YAML file of the scenario; options override it");
  add(app, "--scene", &DriveScenario::scene, "see --list");
  add(app, "--drive", &DriveScenario::drive, "see --list");
  add(app, "--rig", &DriveScenario::rig, "see --list");
  add(app, "--board", &DriveScenario::board, "chessboard or aprilgrid, in the scene chessboard");
  add(app, "--scene-seed", &DriveScenario::scene_seed, "of the scene");
  add(app, "--rig-seed", &DriveScenario::rig_seed, "of the lenses and how they are mounted");
  add(app, "--seed", &DriveScenario::seed, "of the road, and of wheels and noise too");
  add(app, "--sensor-seed", &DriveScenario::sensor_seed, "of wheels and noise, where it is not --seed");
  add(app, "--exposure-gain", &DriveScenario::exposure_gain, "of the images");
  add(app, "--image-scale", &DriveScenario::image_scale, "image size over 1280x800");
  add(app, "--image-step", &DriveScenario::image_step, "only every so many of the 12.5 images a second");
  add(app, "--duration-s", &DriveScenario::duration_s, "end the drive early; 0: at the end of its path");
  add(app, "--cameras", &DriveScenario::cameras, "cameras to render, all by default")->delimiter(',');
  const CLI::Option* noise = app->add_option("--noise", noise_, "on or off")
                                 ->check(CLI::IsMember({"on", "off"}))
                                 ->capture_default_str();
  overrides_.emplace_back([this, noise](DriveScenario* scenario) {
    if (noise->count() > 0) {
      scenario->noise = noise_ == "on";
    }
  });
  app->add_option("--set", settings_,
                  "KEY=VALUE for any field that --show-options shows, as faults.dead_camera.cameras=[left]");
}

template <class T>
CLI::Option* ScenarioCommandLine::add(CLI::App* app, const std::string& name, T DriveScenario::*field,
                                      const std::string& description) {
  CLI::Option* option = app->add_option(name, given_.*field, description)->capture_default_str();
  overrides_.emplace_back([this, option, field](DriveScenario* scenario) {
    if (option->count() > 0) {
      scenario->*field = given_.*field;
    }
  });
  return option;
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
  FaultDescriber faults;
  FaultOptions().visitFields(faults);
  describe(faults.entries, "  ", &text);
  return text.str();
}

}  // namespace vcharge
