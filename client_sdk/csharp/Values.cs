// Values of a world as C# has them: vectors, bodies, events, errors. Plain data; each belongs to whoever has it, but for
// Body, which lies in memory as the library writes it.
using System;
using System.Collections.Generic;
using System.Text;
using Tessera.Native;

namespace Tessera {
  // A call that the library did not take: its code, and its line as the message.
  public sealed class TesseraException : Exception {
    public Code Code { get; }

    public TesseraException(Code code, string line) : base(line) { Code = code; }

    internal static unsafe void Check(Code code) {
      if (code != Code.Ok) throw new TesseraException(code, Utf8.Read(Api.tessera_last_error()));
    }
  }

  // Metres, seconds, newtons; right-handed, y up.
  public readonly struct Vector3d {
    public readonly double X, Y, Z;

    public Vector3d(double x, double y, double z) { X = x; Y = y; Z = z; }

    internal unsafe Vector3d(double* from) : this(from[0], from[1], from[2]) {}
    internal unsafe Vector3d(float* from) : this(from[0], from[1], from[2]) {}

    internal unsafe void WriteTo(float* to) {
      to[0] = (float)X;
      to[1] = (float)Y;
      to[2] = (float)Z;
    }

    public override string ToString() =>
        string.Format(System.Globalization.CultureInfo.InvariantCulture, "({0:F1}, {1:F1}, {2:F1})", X, Y, Z);
  }

  public readonly struct Quaterniond {
    public readonly double X, Y, Z, W;

    internal unsafe Quaterniond(double* from) { X = from[0]; Y = from[1]; Z = from[2]; W = from[3]; }
  }

  // A reference to a body, or to a player by its number, in the values of the game: see Api.TESSERA_FIELD_BODY.
  public readonly struct BodyId {
    public readonly ulong Value;

    public BodyId(ulong value) { Value = value; }
  }

  public readonly struct PlayerId {
    public readonly uint Value;

    public PlayerId(uint value) { Value = value; }
  }

  // A body as it is to be drawn. World.Bodies gives them in place, without a copy.
  public unsafe struct Body {
    internal tessera_body native;

    public ulong Id => native.id;
    public uint Region => native.region;
    public bool Asleep => (native.flags & Api.TESSERA_BODY_ASLEEP) != 0;
    public bool Extrapolated => (native.flags & Api.TESSERA_BODY_EXTRAPOLATED) != 0;
    public bool Own => (native.flags & Api.TESSERA_BODY_OWN) != 0;
    public bool Predicted => (native.flags & Api.TESSERA_BODY_PREDICTED) != 0;
    public Vector3d Position { get { fixed (double* at = native.position) return new Vector3d(at); } }
    public Quaterniond Orientation { get { fixed (double* at = native.orientation) return new Quaterniond(at); } }
    public Vector3d LinearVelocity { get { fixed (float* at = native.linear_velocity) return new Vector3d(at); } }
    public Vector3d AngularVelocity { get { fixed (float* at = native.angular_velocity) return new Vector3d(at); } }
  }

  // Something that the client noticed. Which fields count depends on the kind: see tessera.h.
  public readonly struct Event {
    public readonly EventKind Kind;
    public readonly ulong Body, Other;
    public readonly uint Region, Input, Tile;
    public readonly string Detail, Property;
    public readonly Vector3d ContactPoint, ContactNormal;
    public readonly double ContactImpulse;
    public readonly bool SinceBefore;

    internal unsafe Event(tessera_event* from) {
      Kind = from->kind;
      Body = from->body;
      Other = from->other;
      Region = from->region;
      Input = from->input;
      Tile = from->tile;
      Detail = Utf8.Read(from->detail);
      Property = Utf8.Read(from->property);
      ContactPoint = new Vector3d(from->contact_point);
      ContactNormal = new Vector3d(from->contact_normal);
      ContactImpulse = from->contact_impulse;
      SinceBefore = (from->flags & Api.TESSERA_EVENT_SINCE_BEFORE) != 0;
    }
  }

  // An event that the game sent this player. A value is a bool, long, double, string, Vector3d, BodyId or PlayerId.
  public sealed class GameEvent {
    public string Name { get; }
    public IReadOnlyDictionary<string, object> Values { get; }

    internal GameEvent(string name, Dictionary<string, object> values) { Name = name; Values = values; }

    internal static unsafe object ValueOf(tessera_game_event_field* field) {
      switch (field->type) {
        case FieldType.Bool: return field->integer != 0;
        case FieldType.Int: return field->integer;
        case FieldType.Real: return field->real;
        case FieldType.Text: return Utf8.Read(field->text, checked((int)field->text_size));
        case FieldType.Vector: return new Vector3d(field->vector);
        case FieldType.Body: return new BodyId((ulong)field->integer);
        case FieldType.Player: return new PlayerId((uint)field->integer);
        default: return null;  // of a newer library
      }
    }
  }

  // Text of the C interface: UTF-8 that ends in a 0.
  internal static class Utf8 {
    public static byte[] Bytes(string text) => text == null ? null : Encoding.UTF8.GetBytes(text + "\0");

    public static unsafe string Read(byte* from) {
      if (from == null) return "";
      int size = 0;
      while (from[size] != 0) ++size;
      return Read(from, size);
    }

    public static unsafe string Read(byte* from, int size) => size == 0 ? "" : Encoding.UTF8.GetString(from, size);
  }
}
