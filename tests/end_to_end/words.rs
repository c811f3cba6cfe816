//! A site's own words, and other languages, from the file and the wire to answers.

use crate::site::{Folder, Site, drive, say, settings};
use toponym_proto::answer::{ErrorCode, HeardStatus, WhereReply};
use toponym_proto::keys::Ask;
use toponym_proto::{Message, Say, Stamp};

/// What is told of a name on the map `main`: its candidates' names as shown.
async fn shown(site: &Site, arguments: &str) -> Vec<String> {
    let asked = site.ask(&format!("{}?{arguments}", site.keys.ask("main", Ask::Where)), "").await.unwrap();
    let reply: WhereReply = serde_json::from_value(asked).unwrap();
    reply.candidates.into_iter().map(|c| c.shown).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sites_words_are_learnt_at_start_and_when_it_is_told_to() {
    let folder = Folder::new();
    let lexicon = folder.0.join("words.txt");
    std::fs::write(&lexicon, "mensa = canteen  # as the students say\nname: Bertha\n").unwrap();
    let mut config = settings(&folder);
    config.lexicon = Some(lexicon.clone());
    let site = Site::start(config.clone()).await;
    let (acks, heard) = (site.acks("r1").await, site.listen(site.keys.heard("r1")).await);
    let stream = drive("r1", "main");
    for message in &stream[..61] {
        site.send(message).await;
    }
    acks.ack_of(60).await;
    let said = |id: &str, text: &str, lang: Option<&str>, seq: i64| {
        let began = Some(Stamp { ns: 1_000_000_000 + seq * 50_000_000 });
        Message::Say(Say { lang: lang.map(Into::into), ..say(Some("r1"), id, text, began) })
    };
    for (id, text, lang, seq, status) in [
        ("a", "this is bertha", None, 4, HeardStatus::Understood),
        ("b", "Das ist die Küche", Some("de-AT"), 30, HeardStatus::Understood),
        ("c", "voici la cuisine", Some("fr"), 40, HeardStatus::NotUnderstood),
        ("d", "this is the mensa", None, 58, HeardStatus::Understood),
    ] {
        site.send_json(&said(id, text, lang, seq)).await;
        assert_eq!(heard.heard(id).await.status, status, "{text}");
    }
    site.settle().await;
    assert_eq!(shown(&site, "name=BERTHA").await, ["Bertha"]);
    for arguments in ["name=kitchen", "name=K%C3%BCche", "text=wo%20ist%20die%20k%C3%BCche;lang=de"] {
        assert_eq!(shown(&site, arguments).await, ["Küche"], "{arguments}");
    }
    assert_eq!(shown(&site, "name=mensa").await, ["mensa"]);
    let french = format!("{}?name=cuisine;lang=fr", site.keys.ask("main", Ask::Where));
    let refused = site.ask(&french, "").await.unwrap_err();
    assert_eq!((refused.code, refused.field.as_deref()), (ErrorCode::BadArgument, Some("lang")));

    // What the file says by now holds for maps that are there, too.
    assert_eq!(shown(&site, "name=refectory%20one").await, [""; 0]);
    std::fs::write(&lexicon, "refectory one = canteen\n").unwrap();
    site.server.board().learn(config.words().unwrap());
    site.settle().await;
    assert_eq!(shown(&site, "name=refectory%20one").await, ["mensa"]);
    site.stop().await;

    let site = Site::start(config).await;
    assert_eq!(shown(&site, "name=refectory%20one").await, ["mensa"]);
    site.stop().await;
    std::fs::write(&lexicon, "name: Bertha\nno sign\n").unwrap();
    let mut config = settings(&folder);
    config.lexicon = Some(lexicon);
    let refused = config.words().unwrap_err().to_string();
    assert!(refused.ends_with("words.txt: line 2: neither \"name: …\" nor \"words = words\""), "{refused}");
}
