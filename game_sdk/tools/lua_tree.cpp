#include "game_sdk/tools/lua_tree.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "game_sdk/tools/lua_tokens.h"

namespace tessera::game {
namespace {

using NodePtr = std::unique_ptr<LuaNode>;

constexpr int kMaxChain = 500, kMaxNesting = 250;
constexpr std::array<std::string_view, 21> kBinary = {"+", "-",  "*",  "/", "//", "%", "^",  "..", "==",  "~=", "<",
                                                      ">", "<=", ">=", "&", "|",  "~", "<<", ">>", "and", "or"};

// It follows the grammar of the Lua 5.4 manual, section 9, without the precedence of operators, for which nobody asks.
class LuaParser {
 public:
  explicit LuaParser(std::string_view source) : tokens_(LuaTokens(source)) {}

  absl::StatusOr<NodePtr> Parse() {
    NodePtr block = Block();
    if (now().kind != LuaTokenKind::kEnd) good_ = false;
    if (!good_) return absl::InvalidArgumentError(absl::StrCat("line ", now().line, ": cannot be looked through"));
    return block;
  }

 private:
  const LuaToken& now() const { return tokens_[at_]; }
  void Advance() {
    if (at_ + 1 < tokens_.size()) ++at_;
  }
  bool Take(std::string_view word) {
    if (!now().Is(word)) return false;
    Advance();
    return true;
  }
  void Expect(std::string_view word) {
    if (!Take(word)) good_ = false;
  }
  std::string_view TakeName() {
    if (now().kind != LuaTokenKind::kName) good_ = false;
    const std::string_view name = now().text;
    Advance();
    return name;
  }
  NodePtr Make(LuaNodeKind kind) const {
    auto node = std::make_unique<LuaNode>();
    node->kind = kind;
    node->line = now().line;
    return node;
  }
  static void Add(LuaNode& node, NodePtr child) { node.children.push_back(std::move(child)); }

  bool BlockEnds() const {
    return now().kind == LuaTokenKind::kEnd || now().Is("end") || now().Is("else") || now().Is("elseif") ||
           now().Is("until");
  }

  NodePtr Block() {
    NodePtr block = Make(LuaNodeKind::kBlock);
    if (++nesting_ > kMaxNesting) good_ = false;
    while (good_ && !BlockEnds()) Add(*block, Statement());
    --nesting_;
    return block;
  }

  NodePtr Statement() {
    if (Take("local")) return Local();
    if (now().Is("function")) return FunctionStatement();
    if (now().Is("for")) return For();
    if (now().Is("repeat")) return Repeat();
    if (now().Is("if")) return If();
    NodePtr other = Make(LuaNodeKind::kOther);
    if (Take(";") || Take("break")) return other;
    if (Take("do")) {
      Add(*other, Block());
      Expect("end");
    } else if (Take("while")) {
      Add(*other, Expression());
      Expect("do");
      Add(*other, Block());
      Expect("end");
    } else if (Take("return")) {
      if (!BlockEnds() && !now().Is(";")) Expressions(*other);
      Take(";");
    } else if (Take("goto")) {
      TakeName();
    } else if (Take("::")) {
      TakeName();
      Expect("::");
    } else {
      return ExpressionStatement();
    }
    return other;
  }

  NodePtr Local() {
    if (Take("function")) {
      NodePtr local = Make(LuaNodeKind::kLocalFunction);
      local->names.push_back(TakeName());
      Add(*local, FunctionBody(false));
      return local;
    }
    NodePtr local = Make(LuaNodeKind::kLocal);
    do {
      local->names.push_back(TakeName());
      if (Take("<")) {
        TakeName();
        Expect(">");
      }
    } while (good_ && Take(","));
    if (Take("=")) Expressions(*local);
    return local;
  }

  NodePtr FunctionStatement() {
    NodePtr assign = Make(LuaNodeKind::kAssign);
    Expect("function");
    NodePtr target = Make(LuaNodeKind::kName);
    target->text = TakeName();
    bool method = false;
    for (int i = 0; good_ && !method && (now().Is(".") || now().Is(":")); ++i) {
      if (i > kMaxChain) good_ = false;
      method = now().Is(":");
      Advance();
      target = IndexByName(std::move(target));
    }
    assign->targets = 1;
    Add(*assign, std::move(target));
    Add(*assign, FunctionBody(method));
    return assign;
  }

  NodePtr For() {
    NodePtr loop = Make(LuaNodeKind::kFor);
    Expect("for");
    do {
      loop->names.push_back(TakeName());
    } while (good_ && Take(","));
    if (!Take("=")) Expect("in");
    Expressions(*loop);
    Expect("do");
    Add(*loop, Block());
    Expect("end");
    return loop;
  }

  NodePtr Repeat() {
    NodePtr loop = Make(LuaNodeKind::kRepeat);
    Expect("repeat");
    Add(*loop, Block());
    Expect("until");
    Add(*loop, Expression());
    return loop;
  }

  NodePtr If() {
    NodePtr node = Make(LuaNodeKind::kOther);
    Expect("if");
    do {
      Add(*node, Expression());
      Expect("then");
      Add(*node, Block());
    } while (good_ && Take("elseif"));
    if (Take("else")) Add(*node, Block());
    Expect("end");
    return node;
  }

  NodePtr ExpressionStatement() {
    NodePtr first = Suffixed();
    if (!now().Is("=") && !now().Is(",")) return first;
    NodePtr assign = Make(LuaNodeKind::kAssign);
    assign->line = first->line;
    Add(*assign, std::move(first));
    while (good_ && Take(",")) Add(*assign, Suffixed());
    assign->targets = assign->children.size();
    Expect("=");
    Expressions(*assign);
    return assign;
  }

  void Expressions(LuaNode& into) {
    do {
      Add(into, Expression());
    } while (good_ && Take(","));
  }

  static bool IsBinary(const LuaToken& token) {
    if (token.kind != LuaTokenKind::kWord && token.kind != LuaTokenKind::kSign) return false;
    return std::ranges::find(kBinary, token.text) != kBinary.end();
  }

  void TakeUnary() {
    while (Take("not") || Take("-") || Take("#") || Take("~")) {
    }
  }

  NodePtr Expression() {
    if (++nesting_ > kMaxNesting) good_ = false;
    if (!good_) return Make(LuaNodeKind::kOther);
    const bool unary = now().Is("not") || now().Is("-") || now().Is("#") || now().Is("~");
    TakeUnary();
    NodePtr first = Simple();
    if (unary || IsBinary(now())) {
      NodePtr whole = Make(LuaNodeKind::kOther);
      Add(*whole, std::move(first));
      while (good_ && IsBinary(now())) {
        Advance();
        TakeUnary();
        Add(*whole, Simple());
      }
      first = std::move(whole);
    }
    --nesting_;
    return first;
  }

  NodePtr Simple() {
    if (now().kind == LuaTokenKind::kText) return Text();
    if (now().kind == LuaTokenKind::kNumber || now().Is("nil") || now().Is("true") || now().Is("false") ||
        now().Is("...")) {
      NodePtr other = Make(LuaNodeKind::kOther);
      Advance();
      return other;
    }
    if (now().Is("{")) return Table();
    if (Take("function")) return FunctionBody(false);
    return Suffixed();
  }

  NodePtr Text() {
    NodePtr text = Make(LuaNodeKind::kText);
    text->text = now().text;
    Advance();
    return text;
  }

  NodePtr IndexByName(NodePtr object) {
    NodePtr index = Make(LuaNodeKind::kIndex);
    NodePtr key = Make(LuaNodeKind::kText);
    key->text = TakeName();
    Add(*index, std::move(object));
    Add(*index, std::move(key));
    return index;
  }

  NodePtr Suffixed() {
    NodePtr whole = Make(LuaNodeKind::kOther);
    if (Take("(")) {
      Add(*whole, Expression());
      Expect(")");
    } else {
      whole->kind = LuaNodeKind::kName;
      whole->text = TakeName();
    }
    for (int i = 0; good_; ++i) {
      if (i > kMaxChain) good_ = false;
      if (Take(".")) {
        whole = IndexByName(std::move(whole));
      } else if (now().Is("[")) {
        NodePtr index = Make(LuaNodeKind::kIndex);
        Advance();
        Add(*index, std::move(whole));
        Add(*index, Expression());
        Expect("]");
        whole = std::move(index);
      } else if (now().Is(":")) {
        NodePtr method = Make(LuaNodeKind::kMethod);
        Advance();
        method->text = TakeName();
        Add(*method, std::move(whole));
        Arguments(*method);
        whole = std::move(method);
      } else if (now().Is("(") || now().Is("{") || now().kind == LuaTokenKind::kText) {
        NodePtr call = Make(LuaNodeKind::kCall);
        Add(*call, std::move(whole));
        Arguments(*call);
        whole = std::move(call);
      } else {
        break;
      }
    }
    return whole;
  }

  void Arguments(LuaNode& call) {
    if (now().kind == LuaTokenKind::kText) return Add(call, Text());
    if (now().Is("{")) return Add(call, Table());
    Expect("(");
    if (Take(")")) return;
    Expressions(call);
    Expect(")");
  }

  NodePtr Table() {
    NodePtr table = Make(LuaNodeKind::kTable);
    Expect("{");
    while (good_ && !now().Is("}")) {
      NodePtr field = Make(LuaNodeKind::kField);
      if (Take("[")) {
        Add(*field, Expression());
        Expect("]");
        Expect("=");
      } else if (now().kind == LuaTokenKind::kName && tokens_[at_ + 1].Is("=")) {
        Add(*field, Text());
        Expect("=");
      }
      Add(*field, Expression());
      Add(*table, std::move(field));
      if (!Take(",") && !Take(";")) break;
    }
    Expect("}");
    return table;
  }

  NodePtr FunctionBody(bool method) {
    NodePtr function = Make(LuaNodeKind::kFunction);
    if (method) function->names.emplace_back("self");
    Expect("(");
    while (good_ && !now().Is(")")) {
      if (!Take("...")) function->names.push_back(TakeName());
      if (!Take(",")) break;
    }
    Expect(")");
    Add(*function, Block());
    Expect("end");
    return function;
  }

  const std::vector<LuaToken> tokens_;
  std::size_t at_ = 0;
  int nesting_ = 0;
  bool good_ = true;
};

}  // namespace

absl::StatusOr<std::unique_ptr<LuaNode>> ParseLua(std::string_view source) { return LuaParser(source).Parse(); }

}  // namespace tessera::game
