#include "scenario_command_line.h"

#include <exception>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "vcharge_core/base/options.h"

namespace vcharge {
namespace {

std::string writeFile(const std::string& name, const std::string& text) {
  const std::string path = testing::TempDir() + name;
  std::ofstream(path) << text;
  return path;
}

DriveScenario parse(const std::vector<std::string>& words) {
  CommandLine app;
  const ScenarioCommandLine command_line(&app);
  app.parse(words);
  return command_line.scenario();
}

void expectRejected(const std::vector<std::string>& words, const std::vector<std::string>& told) {
  try {
    parse(words);
    ADD_FAILURE() << words.back();
  } catch (const std::exception& error) {
    for (const std::string& part : told) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }
}

TEST(ScenarioCommandLineTest, FileIsOverriddenByOptionsAndTheseBySet) {
  const std::string file = writeFile("scenario_command_line_test.yaml",
                                     "{drive: loop, rig: random, seed: 3, image_scale: 0.25, noise: false, "
                                     "odometer: {scale_error: 0.01}}");
  const DriveScenario scenario =
      parse({"--scenario", file, "--seed", "4", "--image-scale", "0.5", "--set", "image_scale=0.75", "--set",
             "faults.dead_camera.cameras=[left, rear]"});
  EXPECT_EQ(scenario.drive, "loop");
  EXPECT_EQ(scenario.rig, "random");
  EXPECT_EQ(scenario.seed, 4);
  EXPECT_EQ(scenario.image_scale, 0.75);
  EXPECT_FALSE(scenario.noise);
  EXPECT_EQ(scenario.odometer.scale_error, 0.01);
  EXPECT_EQ(scenario.odometer.metres_per_tick, WheelOdometerOptions().metres_per_tick);
  EXPECT_EQ(scenario.faults.dead_camera.cameras, (std::vector<std::string>{"left", "rear"}));
  EXPECT_TRUE(parse({"--scenario", file, "--noise", "on"}).noise);
  EXPECT_EQ(parse({}).drive, DriveScenario().drive);
}

TEST(ScenarioCommandLineTest, ShownOptionsAreAScenarioFile) {
  const DriveScenario scenario = parse({"--seed", "9", "--cameras", "left,rear", "--set",
                                        "faults.wheel_slip.wheel=right", "faults.wheel_slip.ratio=0.3"});
  std::ostringstream shown;
  shown << writeFields(scenario);
  const DriveScenario again = parse({"--scenario", writeFile("shown_options_test.yaml", shown.str())});
  std::ostringstream shown_again;
  shown_again << writeFields(again);
  EXPECT_EQ(shown.str(), shown_again.str());
  EXPECT_EQ(again.cameras, scenario.cameras);
  EXPECT_EQ(again.faults.wheel_slip.wheel, WheelSlipFault::Wheel::kRight);
}

TEST(ScenarioCommandLineTest, BadKeysAndValuesAreNamed) {
  const std::string file = writeFile("bad_scenario_test.yaml", "faults: {dead_camera: {camera: left}}");
  expectRejected({"--scenario", file}, {"bad_scenario_test.yaml", "faults.dead_camera.camera", "cameras"});
  expectRejected({"--scenario", "/no/such/file.yaml"}, {"/no/such/file.yaml"});
  expectRejected({"--set", "faults.dead_camera.start_s=soon"},
                 {"--set", "faults.dead_camera.start_s", "soon"});
  expectRejected({"--set", "colour=red"}, {"--set", "colour"});
  expectRejected({"--set", "seed"}, {"--set", "KEY=VALUE"});
  expectRejected({"--set", "cameras=[left"}, {"--set", "cameras"});
  expectRejected({"--seed", "-1"}, {"seed", "-1"});
  expectRejected({"--set", "seed.inner=1"}, {"--set", "seed", "whole number"});
}

TEST(ScenarioCommandLineTest, CatalogueShowsScenesDrivesRigsAndFaultsInOneLineEach) {
  const std::string text = "\n" + describeCatalogue();
  for (const char* line : {"\n  lot: ", "\n    short: ", "\n    loop: ", "\n  golf: ", "\n  random: ",
                           "\n  dead_camera: ", "\n  soft_suspension: "}) {
    EXPECT_NE(text.find(line), std::string::npos) << line;
  }
  EXPECT_NE(text.find("[start_s, end_s, wheel, ratio]"), std::string::npos) << text;
}

}  // namespace
}  // namespace vcharge
