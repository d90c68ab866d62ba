#pragma once

#include <cstdint>
#include <string>

struct sqlite3;
struct sqlite3_stmt;

namespace vcharge {

/// An SQLite file. Every failure is an InputError that names the file.
class SqliteDatabase {
 public:
  enum class Access {
    kReadOnly,  ///< writes nothing, not even beside the file, and ignores journals
    kCreate     ///< no rollback journal: for a temporary file that is deleted on failure
  };

  /// `name` is the file's name in errors.
  SqliteDatabase(const std::string& path, const std::string& name, Access access);
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  /// Executes statements without results, separated by ';'.
  void execute(const std::string& sql);
  /// Throws InputError with SQLite's reason and the system's, if any.
  [[noreturn]] void fail() const;

 private:
  friend class SqliteStatement;
  void close();

  std::string name_;
  Access access_;
  sqlite3* handle_ = nullptr;
};

/// A prepared statement; the database must outlive it. Parameters and columns are numbered from 0.
class SqliteStatement {
 public:
  SqliteStatement(const SqliteDatabase& database, const char* sql);
  ~SqliteStatement();
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;

  void bind(int parameter, int64_t value);
  void bind(int parameter, double value);
  void bind(int parameter, const std::string& text);
  /// The bytes must live until the next step().
  void bindBlob(int parameter, const void* data, size_t size);
  void bindNull(int parameter);

  /// Returns true while there is a row.
  bool step();
  /// Executes a statement without rows and resets it for the next parameters.
  void run();
  /// Ends the rows, for the next parameters.
  void reset();

  int64_t integer(int column) const;
  double number(int column) const;
  std::string text(int column) const;
  bool isNull(int column) const;
  /// Valid until the next step(); null if empty.
  const void* blob(int column) const;
  size_t blobSize(int column) const;

 private:
  void check(int result) const;

  const SqliteDatabase& database_;
  sqlite3_stmt* handle_ = nullptr;
};

}  // namespace vcharge
