// All that no game ships: grants from a control plane (libtessera-connect), and a world in this process (libtessera-local).
using System;
using System.Collections.Generic;
using Tessera.Native;

namespace Tessera {
  public static unsafe class Control {
    // Lets a player join, and gives the grant, as a game's backend does. Waits for the control plane; any thread may
    // call it. `address`: as in connect.h; null: this user's `tessera up`.
    public static byte[] GetGrant(string address, string instance, string player = null, uint deadline_ms = 10000) {
      var options = tessera_join_options.Initial;
      options.deadline_ms = deadline_ms;
      var grant = new byte[Api.TESSERA_MAX_GRANT];
      UIntPtr size;
      fixed (byte* at = Utf8.Bytes(address), id = Utf8.Bytes(instance), name = Utf8.Bytes(player), bytes = grant) {
        options.control_address = at;
        options.instance_id = id;
        options.player_name = name;
        TesseraException.Check(Api.tessera_get_grant(&options, bytes, (UIntPtr)grant.Length, &size));
      }
      Array.Resize(ref grant, checked((int)size));
      return grant;
    }
  }

  // A world in this process, for a single player, an editor or a test: a scene and its game without a cluster. One
  // thread for it and its players; the clock is the caller's.
  public sealed unsafe class LocalWorld : IDisposable {
    private IntPtr world_;

    // `scene` is JSON or protobuf's text format, `game` is Lua or null. Throws with file, line and field.
    public LocalWorld(string scene, string game = null) {
      var options = tessera_local_options.Initial;
      byte[] scene_text = Utf8.Bytes(scene), game_text = Utf8.Bytes(game);
      IntPtr world;
      fixed (byte* scene_bytes = scene_text, game_bytes = game_text) {
        options.scene = scene_bytes;
        options.scene_size = (UIntPtr)(scene_text == null ? 0 : scene_text.Length - 1);
        options.game = game_bytes;
        options.game_size = (UIntPtr)(game_text == null ? 0 : game_text.Length - 1);
        TesseraException.Check(Api.tessera_local_world(&options, &world));
      }
      world_ = world;
    }

    private IntPtr Handle => world_ != IntPtr.Zero ? world_ : throw new ObjectDisposedException(nameof(LocalWorld));

    // Another player comes in. The body of one that has left stays.
    public World Join(JoinOptions options = null) {
      IntPtr world = Handle;
      return World.Join((native, client) => Api.tessera_local_join(world, native, client), options);
    }

    // Once a frame, before World.Poll.
    public void Advance(long now_ns) => TesseraException.Check(Api.tessera_local_advance(Handle, now_ns));

    public ulong Tick => Api.tessera_local_tick(Handle);

    // The lines that the game has printed since the last call; "error: " begins one that says what failed.
    public List<string> TakeLines() {
      var lines = new List<string>();
      for (byte* line; (line = Api.tessera_local_line(Handle)) != null;) lines.Add(Utf8.Read(line));
      return lines;
    }

    public void Dispose() {
      Api.tessera_local_close(world_);
      world_ = IntPtr.Zero;
    }
  }
}
