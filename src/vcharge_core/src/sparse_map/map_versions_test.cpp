#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/analytic_map.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kMaxVersions = 3;

/// A map without its landmark `lost`, and with another one moved.
SparseMap changed(const SparseMap& map, int32_t lost, size_t moved) {
  SparseMapContents contents = map.contents();
  std::vector<MapObservation> observations;
  cv::Mat descriptors(0, contents.descriptors.cols, contents.descriptors.type());
  for (size_t i = 0; i < contents.observations.size(); ++i) {
    MapObservation observation = contents.observations[i];
    if (observation.landmark != lost) {
      observation.landmark -= observation.landmark > lost ? 1 : 0;
      observations.push_back(observation);
      descriptors.push_back(contents.descriptors.row(static_cast<int>(i)));
    }
  }
  contents.observations = observations;
  contents.descriptors = descriptors;
  contents.landmarks.erase(contents.landmarks.begin() + lost);
  contents.landmarks[moved].position_m.x() += 0.5;
  contents.landmarks[moved].presence_log_odds = 1.5;
  return SparseMap(std::move(contents));
}

class MapVersionsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    createFolder(folder_);
    writeSparseMap(map_, {{"drive", "a.bag"}}, path_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  int64_t add(const SparseMap& map, const MapProvenance& provenance, int max_versions) const {
    MapFileLock lock(path_);
    const int64_t version = addMapVersion(map, provenance, max_versions, &lock);
    EXPECT_NE(errorOfLock(), "");  // of the file that replaced the locked one
    return version;
  }
  std::string errorOfLock() const {
    try {
      const MapFileLock lock(path_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  size_t numFiles() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  const SparseMap map_{makeAnalyticMap()};
  const std::string folder_ = ::testing::TempDir() + "map_versions_test";
  const std::string path_ = folder_ + "/lot.vmap";
};

TEST_F(MapVersionsTest, GivesBackEveryVersion) {
  const SparseMap second = changed(map_, 7, 20);
  const SparseMap third = changed(second, 50, 20);
  EXPECT_EQ(add(second, {{"drive", "b.bag"}}, kMaxVersions), 2);
  EXPECT_EQ(add(third, {{"drive", "c.bag"}, {"note", "x"}}, kMaxVersions), 3);
  MapProvenance provenance;
  EXPECT_EQ(readSparseMap(path_, &provenance)->contentHash(), third.contentHash());
  EXPECT_EQ(provenance, (MapProvenance{{"drive", "c.bag"}, {"note", "x"}}));
  EXPECT_EQ(readSparseMap(path_, &provenance, 2)->contentHash(), second.contentHash());
  EXPECT_EQ(provenance, (MapProvenance{{"drive", "b.bag"}}));
  EXPECT_EQ(readSparseMap(path_, &provenance, 1)->contentHash(), map_.contentHash());
  const std::vector<MapVersion> versions = readMapVersions(path_);
  ASSERT_EQ(versions.size(), 3U);
  EXPECT_EQ(versions[1].number, 2);
  EXPECT_EQ(versions[1].content_hash, second.contentHash());
  EXPECT_EQ(versions[1].provenance.at("drive"), "b.bag");
  EXPECT_EQ(numFiles(), 1U);
}

TEST_F(MapVersionsTest, ForgetsTheOldestVersions) {
  SparseMap map = map_;
  for (int i = 0; i < 6; ++i) {
    map = changed(map, 3 * i, 100);
    add(map, {}, kMaxVersions);
  }
  const std::vector<MapVersion> versions = readMapVersions(path_);
  ASSERT_EQ(versions.size(), 3U);
  EXPECT_EQ(versions.front().number, 5);
  EXPECT_EQ(versions.back().content_hash, map.contentHash());
  for (const MapVersion& version : versions) {
    EXPECT_EQ(readSparseMap(path_, nullptr, version.number)->contentHash(), version.content_hash);
  }
  try {
    readSparseMap(path_, nullptr, 4);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(path_), HasSubstr("no version 4, expected 5 to 7")));
  }
}

TEST_F(MapVersionsTest, StoresOnlyWhatChanged) {
  AnalyticMapOptions options;
  options.num_landmarks = 3000;
  const SparseMap large(makeAnalyticMap(options));
  writeSparseMap(large, {}, path_);
  const auto size = fs::file_size(path_);
  add(large, {{"drive", "b.bag"}}, kMaxVersions);
  add(changed(large, 7, 20), {}, kMaxVersions);
  // A landmark is in the images of a few keyframes, which are stored again.
  EXPECT_LT(fs::file_size(path_), 3 * size / 2);
}

TEST_F(MapVersionsTest, DoesNotUseIdsAgain) {
  const auto last = static_cast<int32_t>(map_.landmarks().size()) - 1;
  SparseMapContents contents = changed(map_, last, 20).contents();
  const int32_t removed_id = map_.landmarks().back().id;
  contents.landmarks.push_back(map_.landmarks().back());
  contents.landmarks.back().id = kNoId;
  MapObservation observation = contents.observations.back();
  observation.landmark = last;
  contents.observations.push_back(observation);
  contents.descriptors.push_back(contents.descriptors.row(0));
  EXPECT_GT(SparseMap(contents).landmarks().back().id, removed_id);
}

TEST_F(MapVersionsTest, ReadsFilesOfSchema2AndAddsToThem) {
  fs::copy_file(std::string(VCHARGE_TESTING_DATA) + "/schema_2.vmap", path_,
                fs::copy_options::overwrite_existing);
  MapProvenance provenance;
  const auto old = readSparseMap(path_, &provenance);
  EXPECT_EQ(old->keyframes().size(), 6U);
  EXPECT_EQ(old->sessions().size(), 1U);
  EXPECT_EQ(old->landmarks().back().id, static_cast<int32_t>(old->landmarks().size()) - 1);
  EXPECT_EQ(provenance.at("bag"), "analytic.bag");
  EXPECT_EQ(readMapVersions(path_).size(), 1U);
  const SparseMap next = changed(*old, 1, 2);
  EXPECT_EQ(add(next, {}, kMaxVersions), 2);
  EXPECT_EQ(readSparseMap(path_)->contentHash(), next.contentHash());
  EXPECT_EQ(readSparseMap(path_, nullptr, 1)->contentHash(), old->contentHash());
}

TEST_F(MapVersionsTest, OneProcessChangesAMap) {
  {
    const MapFileLock lock(path_);
    EXPECT_THAT(errorOfLock(), AllOf(HasSubstr(path_), HasSubstr("another process")));
    EXPECT_EQ(readMapVersions(path_).size(), 1U);  // readers need no lock
  }
  EXPECT_EQ(errorOfLock(), "");
  EXPECT_THAT([] { MapFileLock("none.vmap"); },
              ::testing::ThrowsMessage<InputError>(HasSubstr("none.vmap: no such file")));
}

TEST_F(MapVersionsTest, AKilledWriterLeavesTheOldVersion) {
  AnalyticMapOptions options;
  options.num_landmarks = 2000;
  const SparseMap large(makeAnalyticMap(options));
  writeSparseMap(large, {}, path_);
  const SparseMap next = changed(large, 7, 20);
  int num_old = 0;
  constexpr int kNumTrials = 40;
  for (int trial = 0; trial < kNumTrials; ++trial) {
    writeSparseMap(large, {}, path_);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      add(next, {}, kMaxVersions);
      _exit(0);
    }
    std::this_thread::sleep_for(std::chrono::microseconds(800 * trial));
    kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    const std::vector<MapVersion> versions = readMapVersions(path_);
    const std::string expected = versions.size() == 1 ? large.contentHash() : next.contentHash();
    EXPECT_EQ(readSparseMap(path_)->contentHash(), expected);
    EXPECT_EQ(errorOfLock(), "");
    num_old += versions.size() == 1 ? 1 : 0;
  }
  EXPECT_GT(num_old, 0);
  EXPECT_EQ(errorOfLock(), "");
  EXPECT_EQ(numFiles(), 1U);  // what killed writers left is gone
}

}  // namespace
}  // namespace vcharge
