#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

/// The errors the library throws. It never prints and never exits; tools and bindings decide what to do.
namespace mirrorbake {

/// Base of everything thrown on bad input.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An argument is outside what the function accepts. The message names the argument, its value and what
/// was expected. Python: ValueError.
class InvalidArgument : public Error {
 public:
  using Error::Error;
  InvalidArgument(std::string_view argument, std::string_view value, std::string_view expected);
};

/// A file is missing, unreadable, corrupt, too large or cannot be written. The message starts with its
/// path. Python: OSError.
class FileError : public Error {
 public:
  FileError(std::string_view path, std::string_view problem);
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// A computation cannot give an answer (a solver that diverges, say). Python: ArithmeticError.
class NumericalError : public Error {
 public:
  using Error::Error;
};

}  // namespace mirrorbake
