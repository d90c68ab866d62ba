#include "vcharge_core/files/file_io.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

class FileIoTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "file_io_test";
    std::filesystem::remove_all(folder_);
    createFolder(folder_);
  }
  int countFiles() const {
    int count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_)) {
      ++count;
    }
    return count;
  }
  std::string folder_;
};

TEST_F(FileIoTest, FailedWriteLeavesWhatWasThere) {
  const std::string path = folder_ + "/a.txt";
  writeTextFileAtomically(path, "old");
  EXPECT_THROW(writeFileAtomically(path,
                                   [](const std::string& temporary) {
                                     writeTextFileAtomically(temporary, "half");
                                     throw InputError("the disk is full");
                                   }),
               InputError);
  EXPECT_EQ(readTextFile(path), "old");
  EXPECT_EQ(countFiles(), 1);
}

TEST_F(FileIoTest, TemporaryFileKeepsTheExtension) {
  writeFileAtomically(folder_ + "/a.png", [](const std::string& temporary) {
    EXPECT_EQ(std::filesystem::path(temporary).extension(), ".png");
    writeTextFileAtomically(temporary, "x");
  });
  EXPECT_EQ(readTextFile(folder_ + "/a.png"), "x");
}

TEST_F(FileIoTest, FolderAppearsAsAWholeOrNotAtAll) {
  const std::string path = folder_ + "/results";
  createFolder(path);
  writeTextFileAtomically(path + "/old.txt", "old");
  {
    const FolderTransaction abandoned(path);
    writeTextFileAtomically(abandoned.path() + "/half.txt", "half");
  }
  EXPECT_EQ(readTextFile(path + "/old.txt"), "old");
  EXPECT_EQ(countFiles(), 1);
  FolderTransaction transaction(path);
  writeTextFileAtomically(transaction.path() + "/new.txt", "new");
  EXPECT_EQ(readTextFile(path + "/old.txt"), "old");
  transaction.commit();
  EXPECT_EQ(readTextFile(path + "/new.txt"), "new");
  EXPECT_FALSE(std::filesystem::exists(path + "/old.txt"));
  EXPECT_EQ(countFiles(), 1);
}

TEST_F(FileIoTest, WritesRelativePathsInTheCurrentFolder) {
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder_);
  for (const std::string path : {"a.txt", "./b.txt", "new/c.txt"}) {
    EXPECT_NO_THROW(requireWritable(path));
    createFolder(std::filesystem::path(path).parent_path().string());
    EXPECT_NO_THROW(writeTextFileAtomically(path, "x"));
    EXPECT_EQ(readTextFile(path), "x");
  }
  for (const std::string path : {"results", "./more/"}) {
    EXPECT_NO_THROW(requireWritableFolder(path));
    FolderTransaction(path).commit();
    EXPECT_TRUE(std::filesystem::is_directory(path));
  }
  EXPECT_NO_THROW(requireWritableFolder("."));
  EXPECT_THROW(FolderTransaction("."), InputError);
  std::filesystem::current_path(before);
}

TEST_F(FileIoTest, CheckOfAnOutputLeavesNothingBehind) {
  requireWritable(folder_ + "/a.txt");
  requireWritable(folder_ + "/new/folder/a.txt");
  requireWritableFolder(folder_ + "/results/");
  EXPECT_EQ(countFiles(), 0);
  writeTextFileAtomically(folder_ + "/a.txt", "old");
  requireWritable(folder_ + "/a.txt");
  EXPECT_EQ(readTextFile(folder_ + "/a.txt"), "old");
  EXPECT_EQ(countFiles(), 1);
}

TEST_F(FileIoTest, OutputOfTheWrongKindIsAnError) {
  writeTextFileAtomically(folder_ + "/file", "x");
  EXPECT_THROW(requireWritable(folder_), InputError);
  EXPECT_THROW(requireWritable(folder_ + "/"), InputError);
  EXPECT_THROW(requireWritable(""), InputError);
  EXPECT_THROW(requireWritableFolder(folder_ + "/file"), InputError);
}

TEST_F(FileIoTest, FolderMayBeNamedWithASlashAtItsEnd) {
  for (const char* text : {"new", "newer"}) {
    FolderTransaction transaction(folder_ + "/results//");
    writeTextFileAtomically(transaction.path() + "/a.txt", text);
    transaction.commit();
    EXPECT_EQ(readTextFile(folder_ + "/results/a.txt"), text);
  }
  EXPECT_EQ(countFiles(), 1);
}

TEST_F(FileIoTest, FolderInPlaceOfAFileIsAnError) {
  writeTextFileAtomically(folder_ + "/file", "x");
  EXPECT_THROW(FolderTransaction(folder_ + "/file"), InputError);
  try {
    const FolderTransaction below(folder_ + "/file/results");
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(folder_ + "/file/results: "), std::string::npos) << error.what();
  }
  EXPECT_EQ(countFiles(), 1);
}

TEST_F(FileIoTest, ErrorsNameThePath) {
  writeTextFileAtomically(folder_ + "/file", "");
  for (const auto& action :
       {std::function<void()>([&] { readTextFile(folder_ + "/missing.txt"); }),
        std::function<void()>([&] { writeTextFileAtomically(folder_ + "/file/missing.txt", ""); }),
        std::function<void()>([&] { createFolder(folder_ + "/file/missing.txt"); }),
        std::function<void()>([&] { requireWritable(folder_ + "/file/missing.txt"); }),
        std::function<void()>([&] { requireWritable("/proc/missing.txt"); }),
        std::function<void()>([&] { requireWritableFolder("/proc/missing.txt/results"); })}) {
    try {
      action();
      FAIL() << "no error";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("missing.txt"), std::string::npos) << error.what();
    }
  }
}

TEST_F(FileIoTest, RemovedFolderTakesAlongWhatAKilledRemovalLeft) {
  const std::string path = folder_ + "/work";
  for (const std::string& made : {path, path + ".removed"}) {
    createFolder(made);
    writeTextFileAtomically(made + "/a.txt", "a");
  }
  removeFolder(path);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_FALSE(std::filesystem::exists(path + ".removed"));
  EXPECT_NO_THROW(removeFolder(path));
}

}  // namespace
}  // namespace vcharge
