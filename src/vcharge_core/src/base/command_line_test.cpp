#include "vcharge_core/base/command_line.h"

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

class CommandLineTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::remove_all(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Exit status of a tool that was called with these words.
  template <class Run>
  static int call(std::vector<std::string> words, const Run& run) {
    words.insert(words.begin(), "tool");
    std::vector<char*> argv;
    for (std::string& word : words) {
      argv.push_back(word.data());
    }
    CLI::App app;
    return runTool(&app, static_cast<int>(argv.size()), argv.data(), run);
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

TEST_F(CommandLineTest, HasNoJsonOptionWhereNothingIsReported) {
  EXPECT_NE(call({"--json", folder_ + "/found.json"}, [] {}), 0);
}

}  // namespace
}  // namespace vcharge
