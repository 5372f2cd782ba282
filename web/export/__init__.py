"""What a user takes away: pictures, charts, replays."""
