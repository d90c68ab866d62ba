#include "vcharge_core/base/command_line.h"

#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

class CommandLineTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::remove_all(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Exit status of a tool that was called with these words.
  template <class Run>
  static int call(CommandLine* command_line, std::vector<std::string> words, const Run& run) {
    words.insert(words.begin(), "/usr/bin/tool");
    std::vector<char*> argv;
    for (std::string& word : words) {
      argv.push_back(word.data());
    }
    return runTool(command_line, static_cast<int>(argv.size()), argv.data(), run);
  }
  template <class Run>
  static int call(const std::vector<std::string>& words, const Run& run) {
    CommandLine command_line;
    return call(&command_line, words, run);
  }

  static nlohmann::json read(const std::string& path) { return nlohmann::json::parse(readTextFile(path)); }

  const std::string folder_ = testing::TempDir() + "command_line_test";
};

TEST_F(CommandLineTest, WritesWhatTheToolFound) {
  std::filesystem::create_directories(folder_);
  const std::string path = folder_ + "/found.json";
  EXPECT_EQ(call({"--json", path}, [](nlohmann::json* found) { (*found)["num_frames"] = 3; }), 0);
  EXPECT_EQ(read(path), nlohmann::json({{"num_frames", 3}}));
}

TEST_F(CommandLineTest, WritesTheErrorBesideWhatWasFoundBefore) {
  std::filesystem::create_directories(folder_);
  const std::string path = folder_ + "/found.json";
  EXPECT_EQ(call({"--json", path},
                 [](nlohmann::json* found) {
                   (*found)["verdict"] = "FAIL";
                   throw std::runtime_error("drive.bag: no turn");
                 }),
            1);
  EXPECT_EQ(read(path), nlohmann::json({{"verdict", "FAIL"}, {"error", "drive.bag: no turn"}}));
}

TEST_F(CommandLineTest, ReadsValuesOfAllTypes) {
  std::string text = "before";
  int number = 1;
  double length_m = 2.0;
  std::vector<double> times_s;
  std::vector<std::string> names;
  bool is_quiet = false;
  CommandLine command_line;
  command_line.addOption("place", &text);
  const auto number_option = command_line.addOption("--number", &number).inRange(0, 5).showDefault();
  const auto length_option = command_line.addOption("--length-m", &length_m);
  command_line.addOption("--times-s", &times_s).expected(2);
  command_line.addOption("--names", &names).delimiter(',');
  command_line.addFlag("--quiet", &is_quiet, "");
  command_line.parse({"here", "--number", "3", "--times-s", "0.5", "1", "--names", "a,b", "--quiet"});
  EXPECT_EQ(text, "here");
  EXPECT_EQ(number, 3);
  EXPECT_TRUE(number_option.isGiven());
  EXPECT_EQ(length_m, 2.0);
  EXPECT_FALSE(length_option.isGiven());
  EXPECT_EQ(times_s, (std::vector<double>{0.5, 1.0}));
  EXPECT_EQ(names, (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(is_quiet);
}

TEST_F(CommandLineTest, RefusesWhatIsNotAsked) {
  const auto refuses = [](const std::vector<std::string>& words) {
    std::string kind, path;
    int number = 1;
    double length_m = 1.0;
    CommandLine command_line;
    const auto path_option = command_line.addOption("--path", &path).check(requireNotEmpty);
    command_line.addOption("--kind", &kind).oneOf({"a", "b"}).needs(path_option);
    command_line.addOption("--number", &number).notNegative().excludes(path_option);
    command_line.addOption("--length-m", &length_m).positive();
    try {
      command_line.parse(words);
    } catch (const std::exception& /*error*/) {
      return true;
    }
    return false;
  };
  EXPECT_FALSE(refuses({}));
  EXPECT_FALSE(refuses({"--path", "p", "--kind", "b"}));
  EXPECT_FALSE(refuses({"--number", "0"}));
  EXPECT_TRUE(refuses({"--other"}));
  EXPECT_TRUE(refuses({"--path", ""}));
  EXPECT_TRUE(refuses({"--kind", "b"}));
  EXPECT_TRUE(refuses({"--path", "p", "--kind", "c"}));
  EXPECT_TRUE(refuses({"--number", "-1"}));
  EXPECT_TRUE(refuses({"--number", "1", "--path", "p"}));
  EXPECT_TRUE(refuses({"--length-m", "0"}));
  EXPECT_TRUE(refuses({"--length-m", "far"}));
}

TEST_F(CommandLineTest, SaysWhichOptionIsMissing) {
  const auto run = [](const std::vector<std::string>& words) {
    std::string path;
    bool show_options = false;
    CommandLine command_line;
    command_line.addOption("--path", &path).required();
    addShowOptions(&command_line, &show_options);
    testing::internal::CaptureStderr();
    const int status = call(&command_line, words, [] {});
    return std::make_pair(status, testing::internal::GetCapturedStderr());
  };
  EXPECT_EQ(run({"--path", "p"}), std::make_pair(0, std::string()));
  EXPECT_EQ(run({"--show-options"}).first, 0);
  const auto [status, text] = run({});
  EXPECT_NE(status, 0);
  EXPECT_EQ(text, "tool: --path is required (see --help)\n");
}

TEST_F(CommandLineTest, HasNoJsonOptionWhereNothingIsReported) {
  EXPECT_NE(call({"--json", folder_ + "/found.json"}, [] {}), 0);
}

}  // namespace
}  // namespace vcharge
