#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "sparse_map/sparse_map_schema.h"
#include "sparse_map/sparse_map_writer.h"
#include "sparse_map/sqlite_database.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {
namespace fs = std::filesystem;
namespace {

using namespace map_file;

int64_t integerOf(const SqliteDatabase& database, const std::string& sql) {
  SqliteStatement select(database, sql.c_str());
  select.step();
  return select.integer(0);
}

/// Moves rows of the newest version that changed, or are gone, to the past, and inserts the new ones.
void replaceRows(const Table& table, int64_t version, SqliteDatabase* database) {
  const std::string name = table.name;
  const std::string staged = "temp.new_" + name;
  const std::string changed = " FROM " + name + " AS c LEFT JOIN " + staged + " AS n ON n." + table.key() +
                              " = c." + table.key() + " WHERE n." + table.key() + " IS NULL OR (" +
                              table.columnNames("c.") + ") IS NOT (" + table.columnNames("n.") + ")";
  database->execute("INSERT INTO past_" + name + " SELECT " + table.columnNames("c.") +
                    ", c.since_version, " + std::to_string(version - 1) + changed);
  database->execute("DELETE FROM " + name + " WHERE " + table.key() + " IN (SELECT c." + table.key() +
                    changed + ")");
  database->execute("INSERT INTO " + name + " SELECT * FROM " + staged + " WHERE " + table.key() +
                    " NOT IN (SELECT " + table.key() + " FROM " + name + ")");
}

/// Removes the oldest versions beyond a number. Returns whether there were any.
bool forgetOldVersions(int64_t newest, int max_versions, SqliteDatabase* database) {
  const std::string oldest_kept = std::to_string(newest - max_versions + 1);
  if (integerOf(*database, "SELECT count(*) FROM version WHERE number < " + oldest_kept) == 0) {
    return false;
  }
  database->execute("DELETE FROM version WHERE number < " + oldest_kept);
  for (const Table& table : tables()) {
    database->execute(std::string("DELETE FROM past_") + table.name + " WHERE until_version < " +
                      oldest_kept);
  }
  return true;
}

/// Copies the file of the newest schema, or converts an older one.
void copyMapFile(const std::string& path, const std::string& copy) {
  if (checkHeader(path) == kSchemaVersion) {
    std::error_code error;
    fs::copy_file(path, copy, fs::copy_options::overwrite_existing, error);
    if (error) {
      throw InputError(path + ": cannot be written: " + error.message());
    }
    return;
  }
  MapProvenance provenance;
  const std::shared_ptr<const SparseMap> map = readSparseMap(path, &provenance);
  SqliteDatabase database(copy, path, SqliteDatabase::Access::kCreate);
  writeFirstVersion(*map, provenance, MapIndex(), &database);
}

}  // namespace

void writeSparseMap(const SparseMap& map, const MapProvenance& provenance, const std::string& path,
                    const MapIndex& index) {
  writeFileAtomically(path, [&](const std::string& temporary) {
    SqliteDatabase database(temporary, path, SqliteDatabase::Access::kCreate);
    writeFirstVersion(map, provenance, index, &database);
  });
}

int64_t addMapVersion(const SparseMap& map, const MapProvenance& provenance, int max_versions,
                      MapFileLock* lock, const MapIndex& index) {
  const std::string& path = lock->path();
  check(max_versions >= 1, "addMapVersion: expected at least one version");
  int64_t version = 0;
  writeFileAtomically(path, [&](const std::string& temporary) {
    copyMapFile(path, temporary);
    SqliteDatabase database(temporary, path, SqliteDatabase::Access::kCreate);
    version = integerOf(database, "SELECT max(number) FROM version") + 1;
    database.execute("BEGIN");
    for (const Table& table : tables()) {
      const std::string sql = table.sql();
      const std::string kCreate = "CREATE TABLE ";
      database.execute("CREATE TEMP TABLE new_" + sql.substr(kCreate.size()));
    }
    writeRows(map, provenance, "temp.new_", version, &database);
    for (const Table& table : tables()) {
      replaceRows(table, version, &database);
    }
    database.execute("INSERT INTO version VALUES (" + std::to_string(version) + ")");
    const bool has_forgotten = forgetOldVersions(version, max_versions, &database);
    writeIndex(map, index, &database);
    database.execute("COMMIT");
    if (has_forgotten) {
      database.execute("VACUUM");
    }
    lock->moveTo(temporary);
  });
  return version;
}

namespace {

/// Removes copies that killed writers left: .<name>.<process>.tmp<extension>.
void removeCopiesOfDeadProcesses(const fs::path& path) {
  const std::string begin = "." + path.stem().string() + ".";
  const std::string end = ".tmp" + path.extension().string();
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= begin.size() + end.size() || name.compare(0, begin.size(), begin) != 0 ||
        name.compare(name.size() - end.size(), end.size(), end) != 0) {
      continue;
    }
    const std::string process = name.substr(begin.size(), name.size() - begin.size() - end.size());
    if (process.find_first_not_of("0123456789") == std::string::npos &&
        kill(static_cast<pid_t>(std::strtol(process.c_str(), nullptr, 10)), 0) != 0 && errno == ESRCH) {
      fs::remove(entry.path(), ignored);
    }
  }
}

}  // namespace

MapFileLock::MapFileLock(const std::string& path) : path_(path) {
  // A writer replaces the file, so that the lock of the file before it means nothing.
  for (;;) {
    descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ < 0) {
      throw InputError(path + ": " + (errno == ENOENT ? "no such file" : std::strerror(errno)));
    }
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      const int reason = errno;
      close(descriptor_);
      throw InputError(path + (reason == EWOULDBLOCK
                                   ? ": another process is changing the map; try again when it has finished"
                                   : std::string(": cannot be locked: ") + std::strerror(reason)));
    }
    struct stat locked {};
    struct stat current {};
    if (fstat(descriptor_, &locked) == 0 && stat(path.c_str(), &current) == 0 &&
        locked.st_ino == current.st_ino && locked.st_dev == current.st_dev) {
      removeCopiesOfDeadProcesses(path);
      return;
    }
    close(descriptor_);
  }
}

void MapFileLock::moveTo(const std::string& replacement) {
  const int descriptor = open(replacement.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0 || flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    const int reason = errno;
    close(descriptor);
    throw InputError(path_ + ": the new version cannot be locked: " + std::strerror(reason));
  }
  close(descriptor_);
  descriptor_ = descriptor;
}

MapFileLock::~MapFileLock() {
  close(descriptor_);
}

}  // namespace vcharge
