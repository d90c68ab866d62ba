#include "sparse_map/sqlite_database.h"

#include <sqlite3.h>

#include <cstring>
#include <filesystem>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// The file as a URI of SQLite, with special characters escaped as %xx.
std::string uriOf(const std::string& path) {
  static const char* const kDigits = "0123456789abcdef";
  std::string uri = "file://";
  for (const char c : std::filesystem::absolute(path).string()) {
    if (c == '%' || c == '?' || c == '#') {
      uri += {'%', kDigits[c >> 4], kDigits[c & 15]};
    } else {
      uri += c;
    }
  }
  return uri;
}

}  // namespace

SqliteDatabase::SqliteDatabase(const std::string& path, const std::string& name, Access access)
    : name_(name), access_(access) {
  const bool reads = access == Access::kReadOnly;
  const std::string uri = uriOf(path) + (reads ? "?immutable=1" : "");
  const int flags =
      SQLITE_OPEN_URI | (reads ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  try {
    if (sqlite3_open_v2(uri.c_str(), &handle_, flags, nullptr) != SQLITE_OK) {
      fail();
    }
    if (reads) {
      // The schema stored in a file is not trusted.
      sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
      sqlite3_db_config(handle_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
      execute("PRAGMA cell_size_check = ON");
    } else {
      execute("PRAGMA journal_mode = OFF");
    }
  } catch (...) {
    close();
    throw;
  }
}

SqliteDatabase::~SqliteDatabase() {
  close();
}

void SqliteDatabase::close() {
  sqlite3_close_v2(handle_);
  handle_ = nullptr;
}

void SqliteDatabase::execute(const std::string& sql) {
  if (sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    fail();
  }
}

void SqliteDatabase::fail() const {
  const bool reads = access_ == Access::kReadOnly;
  std::string text =
      name_ + (reads ? ": cannot be read as a map: " : ": cannot be written: ") + sqlite3_errmsg(handle_);
  const int code = sqlite3_errcode(handle_);
  const int system_code = sqlite3_system_errno(handle_);
  if (system_code != 0 && (code == SQLITE_IOERR || code == SQLITE_CANTOPEN)) {
    text += std::string(" (") + std::strerror(system_code) + ")";
  }
  throw InputError(text);
}

SqliteStatement::SqliteStatement(const SqliteDatabase& database, const char* sql) : database_(database) {
  check(sqlite3_prepare_v2(database.handle_, sql, -1, &handle_, nullptr));
}

SqliteStatement::~SqliteStatement() {
  sqlite3_finalize(handle_);
}

void SqliteStatement::check(int result) const {
  if (result != SQLITE_OK) {
    database_.fail();
  }
}

void SqliteStatement::bind(int parameter, int64_t value) {
  check(sqlite3_bind_int64(handle_, parameter + 1, value));
}

void SqliteStatement::bind(int parameter, double value) {
  check(sqlite3_bind_double(handle_, parameter + 1, value));
}

void SqliteStatement::bind(int parameter, const std::string& text) {
  check(sqlite3_bind_text64(handle_, parameter + 1, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
}

void SqliteStatement::bindBlob(int parameter, const void* data, size_t size) {
  // A null pointer would bind NULL instead of no bytes.
  check(sqlite3_bind_blob64(handle_, parameter + 1, size == 0 ? "" : data, size, SQLITE_STATIC));
}

void SqliteStatement::bindNull(int parameter) {
  check(sqlite3_bind_null(handle_, parameter + 1));
}

bool SqliteStatement::step() {
  const int result = sqlite3_step(handle_);
  if (result != SQLITE_ROW && result != SQLITE_DONE) {
    database_.fail();
  }
  return result == SQLITE_ROW;
}

void SqliteStatement::run() {
  step();
  reset();
}

void SqliteStatement::reset() {
  check(sqlite3_reset(handle_));
}

int64_t SqliteStatement::integer(int column) const {
  return sqlite3_column_int64(handle_, column);
}

double SqliteStatement::number(int column) const {
  return sqlite3_column_double(handle_, column);
}

std::string SqliteStatement::text(int column) const {
  const void* bytes = sqlite3_column_blob(handle_, column);  // the text may contain zero bytes
  const auto size = static_cast<size_t>(sqlite3_column_bytes(handle_, column));
  return bytes == nullptr ? std::string() : std::string(static_cast<const char*>(bytes), size);
}

bool SqliteStatement::isNull(int column) const {
  return sqlite3_column_type(handle_, column) == SQLITE_NULL;
}

const void* SqliteStatement::blob(int column) const {
  return sqlite3_column_blob(handle_, column);
}

size_t SqliteStatement::blobSize(int column) const {
  return static_cast<size_t>(sqlite3_column_bytes(handle_, column));
}

}  // namespace vcharge
