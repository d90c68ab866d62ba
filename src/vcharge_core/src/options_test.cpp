#include "vcharge_core/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/file_io.h"

namespace vcharge {

enum class TestMode { kMean, kBestK };
template <>
std::vector<std::string> enumNames<TestMode>() {
  return {"mean", "best_k"};
}

namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

struct InnerOptions {
  double scale = 2.0;
  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("scale", scale);
  }
  void validate() const { requireField(scale > 0.0, "scale", "must be positive", scale); }
};

struct TestOptions {
  int count = 3;
  double distance_m = 0.5;
  bool enabled = true;
  std::string name = "x";
  std::vector<double> weights = {1.0};
  TestMode mode = TestMode::kMean;
  InnerOptions inner;
  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("count", count);
    visit("distance_m", distance_m);
    visit("enabled", enabled);
    visit("name", name);
    visit("weights", weights);
    visit("mode", mode);
    visit("inner", inner);
  }
  void validate() const {
    requireField(count > 0, "count", "must be positive", count);
    validateInner("inner", inner);
  }
};

std::string errorOf(const std::string& yaml) {
  TestOptions options;
  try {
    readFields(YAML::Load(yaml), "stage.yaml", &options);
  } catch (const InputError& error) {
    EXPECT_EQ(options.count, 3) << "options changed by a failed read";
    return error.what();
  }
  return "no error";
}

TEST(OptionsTest, OverridesWhatIsThereAndKeepsTheRest) {
  TestOptions options;
  readFields(YAML::Load("{count: 5, mode: best_k, weights: [1, 2.5], inner: {scale: 4}}"), "stage.yaml",
             &options);
  EXPECT_EQ(options.count, 5);
  EXPECT_EQ(options.mode, TestMode::kBestK);
  EXPECT_EQ(options.weights, (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(options.inner.scale, 4.0);
  EXPECT_EQ(options.distance_m, 0.5);
  readFields(YAML::Load(""), "empty.yaml", &options);
  EXPECT_EQ(options.count, 5);
}

TEST(OptionsTest, ErrorsNameSourceKeyAndExpectation) {
  EXPECT_THAT(errorOf("{cuont: 5}"),
              AllOf(HasSubstr("stage.yaml"), HasSubstr("cuont"), HasSubstr("distance_m")));
  EXPECT_THAT(errorOf("{inner: {scael: 4}}"), HasSubstr("inner.scael"));
  EXPECT_THAT(errorOf("{count: many}"),
              AllOf(HasSubstr("count"), HasSubstr("whole number"), HasSubstr("many")));
  EXPECT_THAT(errorOf("{count: 2.5}"), HasSubstr("whole number"));
  EXPECT_THAT(errorOf("{inner: {scale: [1]}}"), AllOf(HasSubstr("inner.scale"), HasSubstr("a number")));
  EXPECT_THAT(errorOf("{mode: median}"),
              AllOf(HasSubstr("mode"), HasSubstr("mean, best_k"), HasSubstr("median")));
  EXPECT_THAT(errorOf("{count: 0}"), AllOf(HasSubstr("stage.yaml"), HasSubstr("count: must be positive")));
  EXPECT_THAT(errorOf("{inner: {scale: -1}}"), HasSubstr("stage.yaml: inner.scale: must be positive"));
  EXPECT_THAT(errorOf("[1, 2]"), HasSubstr("a map of"));
  EXPECT_THAT(errorOf("{[1, 2]: 3}"), AllOf(HasSubstr("stage.yaml"), HasSubstr("a text as a key")));
  EXPECT_THAT(errorOf("{inner: {{a: b}: 3}}"), AllOf(HasSubstr("inner"), HasSubstr("a text as a key")));
}

TEST(OptionsTest, WrittenFieldsReadBackTheSame) {
  TestOptions options;
  options.mode = TestMode::kBestK;
  options.inner.scale = 0.1;
  TestOptions copy;
  readFields(writeFields(options), "copy", &copy);
  EXPECT_EQ(copy.mode, TestMode::kBestK);
  EXPECT_EQ(copy.inner.scale, 0.1);
}

TEST(OptionsTest, BadYamlNamesFileAndLine) {
  const std::string path = ::testing::TempDir() + "bad_options.yaml";
  writeTextFileAtomically(path, "count: 3\nmode: [1\n");
  try {
    loadYamlFile(path);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(path), HasSubstr("line")));
  }
}

}  // namespace
}  // namespace vcharge
