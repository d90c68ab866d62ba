#include "vcharge_core/base/options.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/files/file_io.h"

namespace vcharge {

enum class TestMode { kMean, kBestK };
template <>
std::vector<std::string> enumNames<TestMode>() {
  return {"mean", "best_k"};
}

namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

struct InnerOptions {
  VCHARGE_BEGIN_OPTIONS(InnerOptions);
  VCHARGE_OPTION(double, scale, 2.0, positive(), "Factor of all lengths.");
  VCHARGE_END_OPTIONS();
};

struct TestOptions {
  VCHARGE_BEGIN_OPTIONS(TestOptions);
  VCHARGE_OPTION(int, count, 3, positive(), "Number of planes.");
  VCHARGE_OPTION(double, distance_m, 0.5, above(0.1).upTo(2.0), "Distance of the first plane.");
  VCHARGE_OPTION(double, max_distance_m, 5.0, anyValue(), "Distance of the last plane.");
  VCHARGE_OPTION(bool, enabled, true, anyValue(), "Whether planes are used.");
  VCHARGE_OPTION(std::string, name, "x", anyValue(), "Name of the planes.");
  VCHARGE_OPTION(std::vector<double>, weights, {1.0}, notNegative(), "Weight of each plane.");
  VCHARGE_OPTION(TestMode, mode, TestMode::kMean, anyValue(), "How costs are combined.");
  VCHARGE_OPTION_GROUP(InnerOptions, inner, {}, "Scale of the planes.");
  VCHARGE_END_OPTIONS();

  void checkFields() const {
    requireField(max_distance_m > distance_m, "max_distance_m", "must be above distance_m", max_distance_m);
  }
};

struct DerivedOptions : TestOptions {
  VCHARGE_BEGIN_DERIVED_OPTIONS(DerivedOptions, TestOptions);
  VCHARGE_OPTION(int, extra, 1, between(1, 4), "More planes.");
  VCHARGE_END_OPTIONS();

  std::vector<std::string> read;
  void fieldWasRead(const char* field) { read.emplace_back(field); }
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

TEST(OptionsTest, RangesSayWhatIsRequired) {
  EXPECT_EQ(positive().requirement(), "must be positive");
  EXPECT_EQ(notNegative().requirement(), "must not be negative");
  EXPECT_EQ(above(0.0).upTo(1.0).requirement(), "must be in (0, 1]");
  EXPECT_EQ(atLeast(8).requirement(), "must be at least 8");
  EXPECT_EQ(anyValue().below(0.0).requirement(), "must be negative");
  EXPECT_EQ(anyValue().requirement(), "");
  EXPECT_FALSE(positive().contains(0.0));
  EXPECT_FALSE(notNegative().contains(std::nan("")));
  EXPECT_TRUE(between(1, 4).contains(4.0));
}

TEST(OptionsTest, ChecksRangesAndThenFieldsThatDependOnEachOther) {
  EXPECT_THAT(errorOf("{distance_m: 3}"), HasSubstr("distance_m: must be in (0.1, 2]"));
  EXPECT_THAT(errorOf("{weights: [1, -2]}"), HasSubstr("weights: must not be negative, is -2"));
  EXPECT_THAT(errorOf("{max_distance_m: 0.2}"), HasSubstr("max_distance_m: must be above distance_m"));
}

TEST(OptionsTest, DerivedOptionsHaveThoseOfTheirBaseFirst) {
  DerivedOptions options;
  readFields(YAML::Load("{extra: 2, count: 4}"), "derived.yaml", &options);
  EXPECT_EQ(options.count, 4);
  EXPECT_EQ(options.extra, 2);
  EXPECT_EQ(options.read, (std::vector<std::string>{"count", "extra"}));
  options.extra = 9;
  EXPECT_THROW(options.validate(), std::invalid_argument);
}

TEST(OptionsTest, ShownOptionsReadBackAndTellTheirMeaning) {
  TestOptions options;
  options.inner.scale = 0.1;
  const std::string shown = showOptions(options);
  EXPECT_THAT(shown, HasSubstr("count: 3  # Number of planes. (must be positive)"));
  EXPECT_THAT(shown, HasSubstr("mode: mean  # How costs are combined. (one of mean, best_k)"));
  TestOptions copy;
  readFields(YAML::Load(shown), "shown", &copy);
  EXPECT_EQ(copy.inner.scale, 0.1);
}

TEST(OptionsTest, TableListsAGroupOnceAndRefersToItLater) {
  std::map<std::string, std::string> listed;
  const std::string first = optionTable(TestOptions(), "Planes", &listed);
  EXPECT_THAT(first, HasSubstr("|count|`3`|>0|Number of planes.|\n"));
  EXPECT_THAT(first, HasSubstr("|mode|`mean`|mean,best_k|How costs are combined.|\n"));
  EXPECT_THAT(first, HasSubstr("|inner.scale|`2`|>0|Factor of all lengths.|\n"));
  EXPECT_THAT(optionTable(TestOptions(), "Others", &listed),
              AllOf(HasSubstr("|**inner**||see Planes: inner|Scale of the planes.|\n"),
                    Not(HasSubstr("inner.scale"))));
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
