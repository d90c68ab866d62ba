#include "vcharge_core/sparse_map/sparse_map_file.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/analytic_map.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

const MapProvenance kProvenance = {{"bag", "drive.bag"}, {"options", "a: 1\nb: 'two'\n"}};

class SparseMapFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "sparse_map_file_test";
    fs::remove_all(folder_);
    createFolder(folder_);
    path_ = folder_ + "/a%20b?.vmap";  // characters with a special meaning in a URI
    writeSparseMap(map_, kProvenance, path_);
    bytes_ = readTextFile(path_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// The error of reading a file with these bytes; empty on success.
  std::string errorOf(const std::string& bytes) const {
    const std::string path = folder_ + "/changed.vmap";
    std::ofstream(path, std::ios::binary) << bytes;
    return errorOfFile(path);
  }
  static std::string errorOfFile(const std::string& path) {
    try {
      readSparseMap(path);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(path));
      return error.what();
    }
    return "";
  }
  /// The error of reading the map after SQL changed it.
  std::string errorAfter(const std::string& sql) const {
    const std::string path = folder_ + "/changed.vmap";
    std::ofstream(path, std::ios::binary) << bytes_;
    runSql(path, sql);
    return errorOfFile(path);
  }
  static void runSql(const std::string& path, const std::string& sql) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database);
    sqlite3_close(database);
  }
  static std::vector<int> query(const std::string& path, const std::string& sql) {
    sqlite3* database = nullptr;
    sqlite3_stmt* statement = nullptr;
    EXPECT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database);
    std::vector<int> values;
    while (sqlite3_step(statement) == SQLITE_ROW) {
      values.push_back(sqlite3_column_int(statement, 0));
    }
    sqlite3_finalize(statement);
    sqlite3_close(database);
    return values;
  }

  const SparseMap map_{makeAnalyticMap()};
  std::string folder_, path_, bytes_;
};

TEST_F(SparseMapFileTest, GivesBackEveryBit) {
  // Products of transforms have quaternions whose norm is not 1 to the last bit.
  SparseMapContents contents = makeAnalyticMap();
  contents.rig.cameras[1].mask_file = "masks/left.png";
  contents.rig.cameras[1].mask = cv::Mat(480, 640, CV_8UC1, cv::Scalar(7));
  contents.rig.cameras[1].covariance = Eigen::Matrix<double, 6, 6>::Identity() / 3.0;
  for (MapKeyframe& keyframe : contents.keyframes) {
    keyframe.map_from_vehicle =
        keyframe.map_from_vehicle *
        RigidTransform(rotationFromYawPitchRoll(0.1, 0.02, -0.03), Eigen::Vector3d(1e-9, -1.0 / 3.0, 1e5));
    keyframe.covariance.setRandom();
  }
  const SparseMap map(contents);
  writeSparseMap(map, kProvenance, path_);
  MapProvenance provenance;
  const auto read = readSparseMap(path_, &provenance);
  EXPECT_EQ(provenance, kProvenance);
  EXPECT_EQ(read->contentHash(), map.contentHash());
  for (size_t i = 0; i < map.keyframes().size(); ++i) {
    EXPECT_EQ(read->keyframes()[i].stamp, map.keyframes()[i].stamp);
    EXPECT_EQ(read->keyframes()[i].map_from_vehicle.rotation().coeffs(),
              map.keyframes()[i].map_from_vehicle.rotation().coeffs());
    EXPECT_EQ(read->keyframes()[i].covariance, map.keyframes()[i].covariance);
  }
  ASSERT_EQ(read->landmarks().size(), map.landmarks().size());
  EXPECT_EQ(read->landmarks().back().covariance_m2, map.landmarks().back().covariance_m2);
  ASSERT_EQ(read->observations().size(), map.observations().size());
  EXPECT_EQ(read->observations().back().position_px, map.observations().back().position_px);
  EXPECT_EQ(cv::norm(read->descriptors(), map.descriptors(), cv::NORM_INF), 0.0);
  EXPECT_EQ(read->contents().feature_options, contents.feature_options);
  EXPECT_EQ(read->contents().loop_edges[1].reason, contents.loop_edges[1].reason);
  // The content hash does not cover these.
  for (size_t i = 0; i < 2; ++i) {
    const RigCamera& camera = read->rig().cameras[i];
    EXPECT_EQ(camera.image_size_px, contents.rig.cameras[i].image_size_px);
    EXPECT_EQ(camera.field_of_view_rad, contents.rig.cameras[i].field_of_view_rad);
    EXPECT_EQ(camera.frame_id, contents.rig.cameras[i].frame_id);
    EXPECT_EQ(camera.mask_file, contents.rig.cameras[i].mask_file);
    EXPECT_EQ(cv::norm(camera.mask, contents.rig.cameras[i].mask, cv::NORM_INF), 0.0);
  }
  EXPECT_EQ(*read->rig().cameras[1].covariance, *contents.rig.cameras[1].covariance);
}

TEST_F(SparseMapFileTest, KeepsFloatDescriptorsAndAMapOfNothing) {
  AnalyticMapOptions options;
  options.float_descriptors = true;
  const SparseMap with_floats(makeAnalyticMap(options));
  writeSparseMap(with_floats, {}, path_);
  EXPECT_EQ(readSparseMap(path_)->contentHash(), with_floats.contentHash());
  EXPECT_EQ(readSparseMap(path_)->descriptors().type(), CV_32FC1);

  SparseMapContents nothing;
  nothing.rig = makeAnalyticMap().rig;
  writeSparseMap(SparseMap(nothing), {}, path_);
  EXPECT_EQ(readSparseMap(path_)->contentHash(), SparseMap(nothing).contentHash());
}

TEST_F(SparseMapFileTest, TheSameMapGivesTheSameBytes) {
  writeSparseMap(SparseMap(makeAnalyticMap()), kProvenance, folder_ + "/again.vmap");
  EXPECT_EQ(readTextFile(folder_ + "/again.vmap"), bytes_);
}

TEST_F(SparseMapFileTest, CanBeAskedInSql) {
  std::vector<int> expected;
  for (size_t i = 0; i < map_.landmarks().size(); ++i) {
    if (std::abs(map_.landmarks()[i].position_m.x()) <= 5.0) {
      expected.push_back(static_cast<int>(i));
    }
  }
  EXPECT_FALSE(expected.empty());
  EXPECT_EQ(query(path_, "SELECT id FROM landmark WHERE x_m BETWEEN -5 AND 5 ORDER BY id"), expected);
  EXPECT_EQ(query(path_, "SELECT count(*) FROM keyframe"), std::vector<int>{24});
  EXPECT_EQ(query(path_, "SELECT sum(num_observations) FROM image"),
            std::vector<int>{static_cast<int>(map_.observations().size())});
  EXPECT_EQ(query(path_, "SELECT count(*) FROM loop_edge WHERE NOT accepted"), std::vector<int>{1});
}

TEST_F(SparseMapFileTest, NamesFilesThatAreNoMaps) {
  EXPECT_THAT(errorOfFile(folder_ + "/missing.vmap"), HasSubstr("no such file"));
  EXPECT_THAT(errorOfFile(folder_), HasSubstr("is a folder"));
  EXPECT_THAT(errorOf(""), HasSubstr("is empty"));
  EXPECT_THAT(errorOf("a text\n"), HasSubstr("no SQLite file"));
  EXPECT_THAT(errorOf(std::string(100000, '\0')), HasSubstr("no SQLite file"));
  runSql(folder_ + "/other.vmap", "CREATE TABLE meta (key, value)");
  EXPECT_THAT(errorOfFile(folder_ + "/other.vmap"), HasSubstr("another program"));
  EXPECT_THAT(errorAfter("PRAGMA user_version = 4"),
              AllOf(HasSubstr("version 4"), HasSubstr("newer program")));
  EXPECT_THAT(errorAfter("PRAGMA user_version = 1"),
              AllOf(HasSubstr("version 1"), HasSubstr("build it again")));
}

TEST_F(SparseMapFileTest, EveryPrefixIsTruncated) {
  ASSERT_EQ(errorOf(bytes_), "");
  for (size_t length = 1; length < bytes_.size(); length = length < 600 ? length + 1 : length + 4999) {
    const std::string error = errorOf(bytes_.substr(0, length));
    EXPECT_THAT(error, HasSubstr("truncated")) << length;
  }
  // The damage is also detected if the header states the shorter length.
  constexpr size_t kPageSize = 16384;
  for (size_t pages = 1; pages < bytes_.size() / kPageSize; ++pages) {
    std::string shorter = bytes_.substr(0, pages * kPageSize);
    shorter[30] = static_cast<char>(pages >> 8);
    shorter[31] = static_cast<char>(pages & 255);
    EXPECT_NE(errorOf(shorter), "") << pages;
  }
}

// A changed byte either has no meaning or is rejected: it never causes a crash or another map.
TEST_F(SparseMapFileTest, NoChangedByteGivesAnotherMap) {
  std::mt19937 generator(1);
  std::uniform_int_distribution<size_t> any_position(0, bytes_.size() - 1);
  std::uniform_int_distribution<int> any_byte(1, 255);
  const std::string path = folder_ + "/changed.vmap";
  int num_refused = 0;
  constexpr int kNumTrials = 600;
  for (int trial = 0; trial < kNumTrials; ++trial) {
    std::string changed = bytes_;
    // Half of the trials change the first page, which holds the header and the table definitions.
    const size_t position = any_position(generator);
    char& byte = changed[trial % 2 == 0 ? position : position % 8192];
    byte = static_cast<char>(byte ^ any_byte(generator));
    std::ofstream(path, std::ios::binary) << changed;
    try {
      MapProvenance provenance;
      const auto read = readSparseMap(path, &provenance);
      EXPECT_EQ(read->contentHash(), map_.contentHash()) << trial;
      EXPECT_EQ(provenance, kProvenance) << trial;
      EXPECT_EQ(cv::norm(read->rig().cameras[0].mask, map_.rig().cameras[0].mask, cv::NORM_INF), 0.0);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(path));
      ++num_refused;
    }
  }
  EXPECT_GT(num_refused, kNumTrials / 10);
}

TEST_F(SparseMapFileTest, RefusesContentThatDoesNotFit) {
  ASSERT_EQ(errorAfter("PRAGMA cache_size = 10"), "");
  EXPECT_THAT(errorAfter("UPDATE landmark SET x_m = x_m + 1e-9 WHERE id = 5"), HasSubstr("hash"));
  EXPECT_THAT(errorAfter("UPDATE landmark SET x_m = 9e999 WHERE id = 5"),
              AllOf(HasSubstr("landmarks[5]"), HasSubstr("finite")));
  EXPECT_THAT(errorAfter("DELETE FROM landmark WHERE id = 5"),
              AllOf(HasSubstr("no such id: 5"), HasSubstr("landmark")));
  EXPECT_THAT(errorAfter("DELETE FROM image WHERE id = (SELECT min(id) FROM image)"), HasSubstr("damaged"));
  EXPECT_THAT(errorAfter("DELETE FROM meta WHERE key = 'descriptor_size'"), HasSubstr("descriptor_size"));
  EXPECT_THAT(errorAfter("UPDATE meta SET value = -1 WHERE key = 'descriptor_size'"),
              HasSubstr("descriptor_size"));
  EXPECT_THAT(errorAfter("UPDATE meta SET value = 'x' WHERE key = 'content_hash'"), HasSubstr("hash"));
  EXPECT_THAT(errorAfter("UPDATE provenance SET value = 'other.bag' WHERE key = 'bag'"),
              HasSubstr("provenance"));
  EXPECT_THAT(errorAfter("UPDATE camera SET mask_png = x'00' WHERE id = 0"), HasSubstr("masks"));
  EXPECT_THAT(errorAfter("UPDATE keyframe SET qw = 2 WHERE id = 3"),
              AllOf(HasSubstr("keyframe 3"), HasSubstr("unit quaternion")));
  EXPECT_THAT(errorAfter("UPDATE keyframe SET covariance_6x6_f64 = x'0011' WHERE id = 3"),
              AllOf(HasSubstr("keyframe"), HasSubstr("2 bytes, expected 288")));
  EXPECT_THAT(errorAfter("UPDATE keyframe SET stamp_ns = 0 WHERE id = 3"), HasSubstr("increasing stamps"));
  EXPECT_THAT(errorAfter("UPDATE loop_edge SET second = 24 WHERE id = 0"),
              HasSubstr("loop_edge 0: second: there is no such id: 24"));
  EXPECT_THAT(errorAfter("UPDATE loop_edge SET first = -1"), HasSubstr("no such id: -1"));
  EXPECT_THAT(errorAfter("DROP TABLE loop_edge"), HasSubstr("loop_edge"));
  EXPECT_THAT(errorAfter("DROP TABLE landmark; CREATE VIEW landmark AS SELECT 1"), HasSubstr("landmark"));
}

TEST_F(SparseMapFileTest, RefusesBlobsThatDoNotFit) {
  EXPECT_THAT(errorAfter("UPDATE image SET num_observations = 2147483647 WHERE id = 0"),
              HasSubstr("more observations than the file holds"));
  EXPECT_THAT(errorAfter("UPDATE image SET num_observations = num_observations + 1 WHERE id = 0"),
              AllOf(HasSubstr("image"), HasSubstr("bytes, expected")));
  EXPECT_THAT(errorAfter("UPDATE image SET landmarks_i32 = zeroblob(0) WHERE id = 0"),
              HasSubstr("0 bytes, expected"));
  EXPECT_THAT(errorAfter("UPDATE image SET descriptors = zeroblob(5) WHERE id = 1"),
              HasSubstr("5 bytes, expected"));
  EXPECT_THAT(errorAfter("UPDATE image SET positions_px_f32 = zeroblob(100000000) WHERE id = 1"),
              HasSubstr("bytes, expected"));
  // 0x7fffffff, -1 and NaN at the start of the blobs.
  const auto replaced = [](const char* column, const char* bytes) {
    return std::string("UPDATE image SET ") + column + " = CAST(" + bytes + " || substr(" + column +
           ", 5) AS BLOB) WHERE id = 0";
  };
  EXPECT_THAT(errorAfter(replaced("landmarks_i32", "x'ffffff7f'")), HasSubstr("no such id: 2147483647"));
  EXPECT_THAT(errorAfter(replaced("landmarks_i32", "x'ffffffff'")), HasSubstr("no such id: -1"));
  EXPECT_THAT(errorAfter(replaced("positions_px_f32", "x'0000c07f'")), HasSubstr("finite position"));
  EXPECT_THAT(errorAfter("UPDATE image SET camera = 2"), HasSubstr("indices"));
  EXPECT_THAT(errorAfter("UPDATE image SET keyframe = 1000"), HasSubstr("no such id: 1000"));
  EXPECT_THAT(errorAfter("UPDATE image SET keyframe = 0, camera = 0"), HasSubstr("one observation per"));
}

TEST_F(SparseMapFileTest, KeepsTheOldMapWhenTheNewOneCannotBeWritten) {
  AnalyticMapOptions options;
  options.num_landmarks = 3000;
  const SparseMap larger(makeAnalyticMap(options));
  // Simulates a disk that fills up: a child process with a limit on its file size.
  for (const rlim_t limit : {0, 4096, 20000, 200000, 600000}) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      std::signal(SIGXFSZ, SIG_IGN);  // makes the write fail instead of killing the process
      const rlimit size{limit, limit};
      setrlimit(RLIMIT_FSIZE, &size);
      try {
        writeSparseMap(larger, {}, path_);
      } catch (const InputError& error) {
        const bool named = std::string(error.what()).find(path_ + ": cannot be written: ") == 0;
        _exit(named ? 3 : 4);
      } catch (...) {
        _exit(5);
      }
      _exit(0);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status)) << limit;
    EXPECT_EQ(WEXITSTATUS(status), 3) << limit;
    EXPECT_EQ(readTextFile(path_), bytes_) << limit;
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1) << limit;
  }
}

TEST_F(SparseMapFileTest, NamesTheFileThatCannotBeWritten) {
  createFolder(folder_ + "/folder.vmap");
  for (const std::string& path : {std::string("/proc/no/such/folder.vmap"), folder_ + "/folder.vmap",
                                  path_ + "/below_a_file.vmap", std::string("/proc/map.vmap")}) {
    try {
      writeSparseMap(map_, {}, path);
      ADD_FAILURE() << path;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(path));
    }
  }
  EXPECT_TRUE(fs::is_directory(folder_ + "/folder.vmap"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 2);
}

}  // namespace
}  // namespace vcharge
